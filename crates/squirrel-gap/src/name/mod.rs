mod evidence;
mod linear;
mod parameters;
mod search;
mod whiten;

#[doc(hidden)]
pub fn explore(vehicle: &squirrel_sim::vehicle_file::VehicleFile, flights: &[(String, squirrel_sim::log::FlightLog)]) -> String {
    use std::fmt::Write;
    let t0 = std::time::Instant::now();
    let predictor = crate::predictor::Predictor::new(vehicle, flights).unwrap();
    let catalogue = parameters::Catalogue::new(vehicle).unwrap();
    let mut out = String::new();
    let _ = write!(out, "new {:.0} ms; ", t0.elapsed().as_secs_f64() * 1e3);
    let t1 = std::time::Instant::now();
    let r = predictor.residual(&predictor.nominal()).unwrap();
    let _ = write!(out, "predict {:.1} ms rows {}; ", t1.elapsed().as_secs_f64() * 1e3, predictor.rows());
    for c in 0..9 {
        let (s, n) = predictor.segments.iter().filter(|s| s.channel == c).fold((0.0, 0), |(s, n), g| (s + r[g.rows.clone()].iter().map(|x| x * x).sum::<f64>(), n + g.rows.len()));
        let _ = write!(out, "{:.3} ", (s / n as f64).sqrt());
    }
    let search = search::Search { predictor: &predictor, catalogue: &catalogue, progress: &|| () };
    let found = search.run().unwrap();
    let _ = writeln!(out, "\n  total {:.0} ms, null {:.1}", t0.elapsed().as_secs_f64() * 1e3, found.null.log_evidence);
    for m in &found.best.members {
        let _ = writeln!(out, "  NAMED {} {:?}", search.effect(m), m.values);
    }
    let _ = writeln!(out, "  gain {:.1}", found.best.log_evidence - found.null.log_evidence);
    for (e, m) in search.ranked(&found.linear, &found.null, &[]).into_iter().take(5) {
        let _ = writeln!(out, "    rank {} {:.1} {:?}", search.effect(&m), e - found.null.log_evidence, m.values);
    }
    let best = &found.best;
    let point = search.settled(best);
    let h = linear::hypothesis(&predictor, &catalogue, &point).unwrap();
    let e = predictor.residual(&h).unwrap();
    let spikes = point.base;
    for (i, x) in spikes.iter().enumerate() {
        let z = x / found.linear.tolerance[i];
        if z.abs() > 1.5 {
            let name = catalogue.parameters.get(i).map_or("sensor".to_owned(), |p| format!("{} {} {:?}", catalogue.candidates[p.candidate].effect, p.key, catalogue.candidates[p.candidate].fixed));
            let _ = write!(out, "   spike {name} {x:.4} = {z:.1} sd;");
        }
    }
    let _ = writeln!(out);
    let nominal = r;
    let motions: Vec<_> = (0..predictor.tracks.len()).map(|i| predictor.motion(i, &h)).collect();
    let wind: Vec<usize> = (0..catalogue.parameters.len()).filter(|i| catalogue.parameters[*i].key.starts_with("wind_")).collect();
    let t2 = std::time::Instant::now();
    let left = crate::leftover::leftover(&predictor, &motions, &e, &nominal, [&found.linear.raw[wind[0]], &found.linear.raw[wind[1]]], 0.12);
    let _ = writeln!(out, "  leftover {:.0} ms {:?} goes with {:?} {:?} line {:?} gust {}", t2.elapsed().as_secs_f64() * 1e3, left.excess, left.goes_with(), &left.families[..left.families.len().min(3)], left.line, left.looks_like_gust());
    for b in &left.bands {
        let _ = write!(out, " {}{} {:.2} {:.2};", b.flight, b.channel, b.slow / b.slow_floor, b.whole / b.whole_floor);
    }
    let _ = writeln!(out);
    out
}
