//! From flights to a verdict: check that the logs agree with themselves, name what is missing,
//! prove it on other flights.

use crate::GapError;
use crate::baseline::Baseline;
use crate::compatibility::{self, Gyroscope, Moments, Ready};
use crate::decide::{alternatives, close, decide, shared, stays};
use crate::diagnosis::{Covered, Details, Diagnosis, Own};
use crate::find;
use crate::fitted;
use crate::name::{
    NATS_MIN, Search, catalogue, explain_flights, only, sds, silent_tolerances, standing,
    stands_beside_a_gap,
};
use crate::picture;
use crate::predictor::{Hypothesis, Predictor};
use crate::proof::{gap, hold, prove};
use crate::verdict::{Kind, SetAside, Verdict, nothing_to_add};
use squirrel_core::effects::{BatterySag, Effect, Effects, Shown};
use squirrel_core::vehicle::{ThrustCurve, Vehicle};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

/// Part of the held-out error above noise that a name must remove whose form is another one, where
/// moments have little to do with the file's.
const MOST_OF_A_GAP: f64 = 0.9;

/// Looks at flights of a vehicle and says which effect its file lacks.
///
/// * `flights` - name and log of each, which the explanation is fitted to
/// * `held_out` - flights that it never sees, for the proof; may be empty
/// * `progress` - called with what is being done
///
/// # Errors
/// [`GapError`]: a log or vehicle that nothing can be computed with. A log that contradicts itself
/// is no error but the verdict [`Kind::DataProblem`].
pub fn diagnose(
    vehicle: &VehicleFile,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    progress: &dyn Fn(&str),
) -> Result<Diagnosis, GapError> {
    diagnose_against(vehicle, None, flights, held_out, progress)
}

/// Looks at flights of a machine and says what has changed since those of a baseline.
///
/// * arguments as of [`diagnose`]
///
/// # Errors
/// As [`diagnose`]; a flight that is one of the baseline.
pub fn diagnose_since(
    baseline: &Baseline,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    progress: &dyn Fn(&str),
) -> Result<Diagnosis, GapError> {
    baseline.has_none_of(flights.iter().chain(held_out))?;
    diagnose_against(&baseline.declared, Some(baseline), flights, held_out, progress)
}

fn diagnose_against<'a>(
    vehicle: &'a VehicleFile,
    baseline: Option<&'a Baseline>,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    progress: &dyn Fn(&str),
) -> Result<Diagnosis, GapError> {
    progress("reading");
    let mut diagnosis = sorted(vehicle, baseline, flights, held_out, progress)?;
    let verdict = &mut diagnosis.verdict;
    compatibility::tell(verdict, flights.len() + held_out.len());
    if let Some(baseline) = baseline {
        let aside = baseline.set_aside.iter();
        verdict.notes.extend(aside.map(|a| format!("set aside of the baseline: {}", a.words)));
        if let Some(since) = &mut verdict.baseline {
            since.flights.clone_from(&baseline.flights);
        }
        let source = format!("gap, baseline: {}", baseline.flights.join(", "));
        diagnosis.before = Some(Own { vehicle: baseline.vehicle.clone(), source });
    }
    Ok(diagnosis)
}

/// The diagnosis of the flights whose data agree with themselves.
fn sorted<'a>(
    vehicle: &'a VehicleFile,
    baseline: Option<&'a Baseline>,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    progress: &dyn Fn(&str),
) -> Result<Diagnosis, GapError> {
    let without = |aside: Vec<SetAside>| {
        let [flights, held_out] = [flights, held_out].map(|logs| compatibility::kept(logs, &aside));
        let mut diagnosis = sorted(vehicle, baseline, &flights, &held_out, progress)?;
        diagnosis.verdict.set_aside.splice(..0, aside);
        Ok(diagnosis)
    };
    let ready = match Ready::new(vehicle, flights, held_out) {
        Ok(ready) => ready,
        Err(error) => {
            return without(compatibility::unreadable(vehicle, flights, held_out, error)?);
        }
    };
    progress("checking the data");
    let before = baseline.map_or(&[][..], |own| &own.known);
    let aside = compatibility::problems(&ready, before, flights, held_out)?;
    let is_bad = |(name, _): &(String, FlightLog)| aside.iter().any(|a| a.flight == *name);
    if let Some(first) = aside.first().filter(|_| flights.iter().all(is_bad)) {
        let (goes_with, words) =
            (format!("{}: {}", first.flight, first.channel), first.words.clone());
        let places = find::places(&ready.predictor, &ready.nominal)?;
        let verdict = Verdict {
            verdict: Kind::DataProblem,
            effects: Vec::new(),
            moved: Vec::new(),
            alternatives: Vec::new(),
            places,
            goes_with: Some(goes_with),
            fly_next: None,
            gap: None,
            leftover: None,
            closed_loop: Vec::new(),
            model_patch: None,
            baseline: None,
            words,
            set_aside: aside,
            notes: ready.predictor.notes.clone(),
        };
        return Ok(Diagnosis {
            verdict,
            domain: covered(&ready.predictor),
            before: None,
            now: None,
            details: None,
        });
    }
    if !aside.is_empty() {
        return without(aside);
    }
    if let Some(own) = baseline {
        // What a machine's own numbers make of quick moments says nothing of its data.
        let ready = Ready::new(&own.vehicle, flights, held_out)?;
        return judged(&own.vehicle, baseline, flights, held_out, ready, own.moments, progress);
    }
    let plain = |ready| judged(vehicle, None, flights, held_out, ready, Moments::IfKnown, progress);
    // In two kinds of flights the answer with all moments stands beside the one without them.
    let is_blown = ready.turns_in_unknown_air();
    let strays = ready.predictor.has_motion() && ready.gyroscope() == Gyroscope::Strays;
    if !is_blown && !strays {
        return plain(ready);
    }
    let again = Ready::new(vehicle, flights, held_out)?;
    let whole = judged(vehicle, None, flights, held_out, again, Moments::All, progress)?;
    // Moments that stray count where what lasts explains all of them; else they would be read into
    // whatever name takes most of it, or noise of the gyroscope into a lag.
    if strays && lasting(&whole.verdict) && whole.verdict.verdict == Kind::Named {
        return Ok(whole);
    }
    let plain = plain(ready)?;
    let takes_whole = if is_blown {
        names_more(&whole.verdict, &plain.verdict)
    } else {
        says_more(&whole.verdict, &plain.verdict)
    };
    Ok(if takes_whole { whole } else { plain })
}

/// Whether a verdict with all moments names all that one without them names, and more: air at an
/// unknown velocity turns a vehicle, too, and then it names nothing.
fn names_more(whole: &Verdict, plain: &Verdict) -> bool {
    let names = |verdict: &Verdict| -> Vec<&str> {
        let stand = nothing_to_add(verdict).is_none();
        verdict.effects.iter().filter(|_| stand).map(|effect| effect.name).collect()
    };
    let (whole, plain) = (names(whole), names(plain));
    whole.len() > plain.len() && plain.iter().all(|name| whole.contains(name))
}

/// Whether all names that a verdict tells last, those of sets that it does not tell apart as well.
fn lasting(verdict: &Verdict) -> bool {
    let is_open = verdict.verdict == Kind::Ambiguous;
    let sets = verdict.alternatives.iter().filter(|_| is_open);
    let open = sets.flat_map(|set| set.effects.iter().copied());
    verdict.effects.iter().map(|effect| effect.name).chain(open).all(lasts)
}

/// Whether a verdict with all moments says more than one without those that stray: a name whose
/// form alone differs, which held-out flights want, or a few sets that leave nothing.
fn says_more(whole: &Verdict, plain: &Verdict) -> bool {
    let says_nothing = [Kind::None, Kind::NotIdentifiable].contains(&plain.verdict);
    let leaves_nothing = whole.leftover.as_ref().is_some_and(|left| left.channels.is_empty());
    let removes_most = whole.gap.as_ref().is_some_and(|gap| gap.removed_fraction >= MOST_OF_A_GAP);
    lasting(whole)
        && match whole.verdict {
            Kind::NamedFormDiffers => {
                removes_most && (says_nothing || plain.verdict == Kind::Ambiguous)
            }
            Kind::Ambiguous => says_nothing && leaves_nothing,
            _ => false,
        }
}

/// Whether an effect shows in what lasts of the dynamics.
fn lasts(name: &str) -> bool {
    Effects::<f64>::profile(name).is_some_and(|profile| profile.shown.has(Shown::LASTING))
}

/// The diagnosis of flights that agree with themselves.
fn judged(
    vehicle: &VehicleFile,
    baseline: Option<&Baseline>,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    ready: Ready<'_>,
    moments: Moments,
    progress: &dyn Fn(&str),
) -> Result<Diagnosis, GapError> {
    let domain = covered(&ready.predictor);
    let places = find::places(&ready.predictor, &ready.nominal)?;
    let strays = moments == Moments::All && ready.gyroscope() == Gyroscope::Strays;
    let Ready { mut predictor, nominal, mut unseen } = ready.narrowed(flights, moments)?;
    let has_other_moments = predictor.has_motion() && !predictor.has_channel(3);
    if let Some(unseen) = &mut unseen {
        unseen.keep_moments_of(&predictor);
    }
    let curve_hides_sag = curve_hides_sag(&predictor, &nominal)?;
    if curve_hides_sag {
        predictor.notes.push(
            "propulsion.pwm_to_thrust_n: inside its sd the thrust curve does in these flights what battery_sag does".to_owned(),
        );
    }
    predictor.notes.extend(silent_tolerances(vehicle));
    progress("naming");
    let mut catalogue = catalogue(&predictor, &nominal)?;
    if let Some(baseline) = baseline {
        catalogue.take(&baseline.scatter);
    }
    if strays {
        catalogue.hold_gyroscope();
    }
    let tick = || progress("naming");
    let naming = explain_flights(&predictor, &mut catalogue, &tick)?;
    let search =
        Search { predictor: &predictor, catalogue: &catalogue, gust_m_s: None, progress: &tick };
    let wanted = |naming: &_| hold(unseen.as_ref(), &search, naming);
    let mut naming = standing(&search, naming, wanted)?;
    let rivals = search.rivals(&naming.found)?;
    progress("flying the held-out flights");
    let proven = |naming: &_, rivals: &[_]| -> Result<_, GapError> {
        let proof = match &unseen {
            Some(unseen) => prove(unseen, &search, naming, rivals)?,
            None => None,
        };
        let gap = proof.as_ref().map(|proof| gap(held_out, proof));
        Ok((proof, gap))
    };
    let best = search.weighed(&naming.found.best);
    let near = rivals.iter().filter(|rival| search.weighed(rival) > best - NATS_MIN).count();
    let (mut proof, mut numbers) = proven(&naming, &rivals[..rivals.len().min(1.max(near))])?;
    let close = close(&search, &naming, &rivals, proof.as_ref(), numbers.as_ref());
    let mut open = Vec::new();
    if let Some(kept) = shared(&search, &naming, &close) {
        open = alternatives(
            &search,
            &naming,
            std::iter::once(&naming.found.best).chain(close.iter().copied()),
        );
        naming = only(&search, &naming, &kept)?;
        (proof, numbers) = proven(&naming, &[])?;
    }
    if !naming.leftover.is_real() && numbers.as_ref().is_some_and(stays) {
        naming.stands = stands_beside_a_gap(&search, &naming, wanted)?;
    }
    let verdict = decide(&search, &naming, &rivals, &close, numbers, places, open, curve_hides_sag);
    let names: Vec<&str> = flights.iter().map(|(name, _)| name.as_str()).collect();
    let stands = nothing_to_add(&verdict).is_none();
    let set = if stands { &naming.found.best } else { naming.found.null.as_ref() };
    let own = fitted::of(&search, set)?;
    let fits_moments = has_other_moments && search.predictor.has_gyroscope() && baseline.is_none();
    // Under priors as wide as what is plausible, flights may ask for a body that cannot be: then
    // its moments stay the file's.
    let with_moments =
        if fits_moments { fitted::with_moments(&search, set, flights).ok() } else { None };
    let tolerance = match with_moments {
        Some(_) => "inside its tolerance, moments beyond it",
        None => "inside its tolerance",
    };
    let source = format!("gap, {tolerance}: {}", names.join(", "));
    let now = Own { vehicle: with_moments.unwrap_or(own), source };
    let details = Details {
        evidence: search.single_evidence(&naming.found),
        confusability: search.confusability(&naming.found.null),
        seen: picture::seen(&search, &naming, &rivals)?,
        held_out: proof,
    };
    Ok(Diagnosis { verdict, domain, before: None, now: Some(now), details: Some(details) })
}

/// Whether the thrust curve of the vehicle file, moved by its sd, changes the vertical force more
/// than the smallest sag worth reporting: then nothing tells the two apart.
pub(crate) fn curve_hides_sag(predictor: &Predictor, nominal: &[f64]) -> Result<bool, GapError> {
    if !predictor.has_voltage() {
        return Ok(false);
    }
    let vehicle = predictor.vehicle;
    let mut p = *vehicle.vehicle.parameters();
    let (Some(curve), Some(sd)) =
        (p.propulsion.thrust_curve, sds(vehicle, "propulsion.pwm_to_thrust_n"))
    else {
        return Ok(false);
    };
    let change = |hypothesis: &Hypothesis| -> Result<f64, GapError> {
        let rows = predictor.residual(hypothesis)?;
        let own = predictor.segments.iter().filter(|s| s.channel == 2).flat_map(|s| s.rows.clone());
        Ok(own.map(|row| (rows[row] - nominal[row]).powi(2)).sum())
    };
    let mut sag = predictor.nominal();
    if let Some(found) = sag.effects.insert(BatterySag::<f64>::NAME) {
        found.values[0] += 0.4;
    }
    let sag = change(&sag)?;
    for (i, sd) in sd.iter().enumerate().take(4).filter(|(_, sd)| **sd > 0.0) {
        let mut coefficients = curve.coefficients();
        coefficients[i] += sd;
        let Ok(moved) = ThrustCurve::new(coefficients, p.propulsion.reference_voltage_v) else {
            continue;
        };
        p.propulsion.thrust_curve = Some(moved);
        let Ok(vehicle) = Vehicle::new(p) else { continue };
        if change(&Hypothesis { vehicle, ..predictor.nominal() })? > sag {
            return Ok(true);
        }
    }
    Ok(false)
}

/// What the flights covered.
fn covered(predictor: &Predictor) -> Vec<Covered> {
    let (mut speed, mut height, mut tilt, mut voltage) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (track, motion) in predictor.tracks.iter().zip(predictor.plain()) {
        for (body, volt) in motion.body.iter().zip(&track.voltage_v).step_by(track.every) {
            speed.push(body.velocity.vector.norm());
            height.push(-body.position.vector.z);
            let down = body.ned_from_body().quaternion.inverse() * nalgebra::Vector3::z();
            tilt.push(down.z.clamp(-1.0, 1.0).acos().to_degrees());
            voltage.push(*volt);
        }
    }
    let logged = predictor.has_motion();
    let mut all = Vec::new();
    let mut push = |name, values: &mut Vec<f64>, unit, is_logged: bool| {
        if is_logged && !values.is_empty() {
            values.sort_unstable_by(f64::total_cmp);
            let at = |share: f64| values[(share * (values.len() - 1) as f64) as usize];
            all.push(Covered { name, low: at(0.02), high: at(0.98), unit });
        }
    };
    push("speed", &mut speed, "m/s", logged);
    push("height", &mut height, "m", logged);
    push("tilt", &mut tilt, "deg", logged);
    push("voltage", &mut voltage, "V", predictor.has_voltage());
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verdict::{Alternative, Gap, Left, NamedEffect};
    use std::collections::BTreeMap;

    /// With names, as sets that are open where nothing tells them apart.
    fn verdict(kind: Kind, names: &[&'static str], removed_fraction: f64) -> Verdict {
        let effect = |name: &&'static str| NamedEffect {
            name,
            form: "standard",
            evidence_nats: 20.0,
            parameters: BTreeMap::new(),
        };
        let alternative = |name: &&'static str| Alternative {
            effects: vec![*name],
            evidence_nats: 20.0,
            numbers: Vec::new(),
        };
        let (told, others) = match kind {
            Kind::Ambiguous => names.split_at(names.len().min(1)),
            _ => (names, ["accel_scale"].as_slice()),
        };
        let gap = Gap {
            held_out_flights: vec!["third".to_owned()],
            before: 1e4,
            after: 1.0,
            best_rival: None,
            removed_fraction,
            best_rival_removed_fraction: None,
        };
        let leftover =
            Left { share_removed: 0.99, share_left: 0.0, channels: Vec::new(), goes_with: None };
        Verdict {
            verdict: kind,
            effects: told.iter().map(effect).collect(),
            moved: Vec::new(),
            // Rivals stand beside every name.
            alternatives: others.iter().map(alternative).collect(),
            places: Vec::new(),
            goes_with: None,
            fly_next: None,
            gap: Some(gap),
            leftover: Some(leftover),
            closed_loop: Vec::new(),
            model_patch: None,
            baseline: None,
            words: String::new(),
            set_aside: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// A lag or a clock beside the others may be the gyroscope's noise.
    #[test]
    fn moments_that_stray_say_more_where_what_lasts_explains_them() {
        let plain = |kind| verdict(kind, &[], 0.0);
        let says = |whole: &Verdict, kind| says_more(whole, &plain(kind));
        let form = verdict(Kind::NamedFormDiffers, &["weak_rotor"], 0.99);
        assert!(says(&form, Kind::None) && says(&form, Kind::Ambiguous));
        assert!(!says(&form, Kind::Named));
        assert!(!says(&verdict(Kind::NamedFormDiffers, &["weak_rotor"], 0.8), Kind::None));
        assert!(!says(&verdict(Kind::NamedFormDiffers, &["motor_lag"], 0.99), Kind::None));
        let sets = verdict(Kind::Ambiguous, &["weak_rotor", "cg_offset"], 0.99);
        assert!(says(&sets, Kind::NotIdentifiable) && !says(&sets, Kind::Ambiguous));
        assert!(!says(&verdict(Kind::Ambiguous, &["weak_rotor", "clock_step"], 0.99), Kind::None));
        assert!(!says(&verdict(Kind::OutsideCatalogue, &[], 0.99), Kind::None));
    }
}
