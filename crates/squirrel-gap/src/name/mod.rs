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
    for f in 0..predictor.names.len() {
        let _ = write!(out, "  LF {f}: ");
        for c in 0..9 {
            for s in predictor.segments.iter().filter(|s| s.channel == c && s.flight == f) {
                let x = &e[s.rows.clone()];
                let n = if c < 6 { 8 } else { 4 };
                let means: Vec<f64> = x.chunks_exact(n).map(|w| w.iter().sum::<f64>() / n as f64).collect();
                let rms = (means.iter().map(|m| m * m).sum::<f64>() / means.len() as f64).sqrt();
                let all = (x.iter().map(|m| m * m).sum::<f64>() / x.len() as f64).sqrt();
                let _ = write!(out, "{rms:.4}/{all:.3} ");
            }
        }
        let _ = writeln!(out);
    }
    out
}
