//! Effects whose equation has a file of its own: each is hidden in flights of the independent
//! generator, named from these, and written into the vehicle file. `SQUIRREL_EFFECT=NAME` asks for
//! one of them alone.

use hidden_effects::case::{Case, Set};
use hidden_effects::catalogue::CATALOGUE;
use hidden_effects::draw::Draw;
use squirrel_gap::{Kind, Workflow};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

/// Part of the hidden size by which the one that is found may be off.
const OFF: f64 = 0.15;

#[test]
fn each_is_named_with_its_size_and_written_into_the_file() {
    let only = std::env::var("SQUIRREL_EFFECT");
    let is_asked_for = |name: &str| only.as_ref().map_or(true, |only| only == name);
    let mut tried = 0;
    for entry in
        CATALOGUE.iter().filter(|entry| !entry.shows.is_empty() && is_asked_for(entry.name))
    {
        let none = Case::draw(Set::None, 0, 3);
        let nominal = none.nominal();
        let effect = entry.draw_above(
            2.0,
            &mut Draw::new(5),
            "standard",
            nominal.mass_kg,
            nominal.rotors.len(),
        );
        let case = none.hiding(vec![effect.clone()], None);
        let flight = |number: usize| -> (String, FlightLog) {
            (format!("flight {number}"), case.flight(number).unwrap())
        };
        let vehicle = VehicleFile::parse(&case.vehicle_toml(), "vehicle.toml").unwrap();
        let flights = vec![flight(0), flight(1)];
        let mut found =
            Workflow::diagnose(vehicle, &[], flights, vec![flight(2)], &|_| ()).unwrap();
        let verdict = &found.diagnosis.verdict;
        let names: Vec<&str> = verdict.effects.iter().map(|named| named.name).collect();
        assert!(
            verdict.verdict == Kind::Named && names == [entry.name],
            "{}: {}",
            entry.name,
            verdict.words
        );

        let mut patched = found.patched(false).unwrap().unwrap();
        assert!(patched.text.contains(&format!("[effects.{}]", entry.name)), "{}", patched.text);
        let written = patched.vehicle.effects.get_mut(entry.name).unwrap();
        for key in entry.draw(&mut Draw::new(5), "standard", 0.5, 4).sizes().concat() {
            let place = written.parameters.iter().position(|p| p.key == key).unwrap();
            let (is, was) = (written.values[place], effect.number(key));
            assert!((is - was).abs() < OFF * was.abs(), "{} {key}: {is} for {was}", entry.name);
        }
        // Another autopilot flew these flights: a note says why none is flown again.
        found.fly_again(&patched).unwrap();
        let notes = &found.diagnosis.verdict.notes;
        assert!(notes.iter().any(|note| note.contains("not flown again")), "{notes:?}");
        tried += 1;
    }
    assert!(tried > 0);
}
