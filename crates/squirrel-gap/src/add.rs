//! The vehicle file with the named effects in it: a patch that keeps every comment and the order of
//! what was there.

use crate::diagnosis::{Diagnosis, Own};
use crate::verdict::{Kind, NamedEffect, Value, nothing_to_add};
use squirrel_core::effects::{EffectParameter, Effects, FORM, Kind as ParameterKind, forms};
use squirrel_sim::vehicle_file::VehicleFile;
use std::fmt::Write;
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, value};

/// The text of the vehicle file with the effects of a diagnosis added, each number with its
/// interval, the flights that it comes from, and what they covered.
///
/// * `flights` - names of the flights
///
/// # Errors
/// One line: the text is not TOML, or the patched file would not be a vehicle.
pub fn add(
    vehicle: &VehicleFile,
    diagnosis: &Diagnosis,
    flights: &[String],
) -> Result<String, String> {
    with(vehicle, diagnosis, diagnosis.before.as_ref(), &diagnosis.verdict.effects, flights)
}

/// As [`add`], and with the file's own numbers where these flights have them, each inside its
/// tolerance; without a name where none stands. What is proven on held-out flights is this whole
/// explanation.
///
/// # Errors
/// One line: something is missing that such numbers would take up; or as [`add`].
pub fn fit(
    vehicle: &VehicleFile,
    diagnosis: &Diagnosis,
    flights: &[String],
) -> Result<String, String> {
    let verdict = &diagnosis.verdict;
    let own = diagnosis.before.as_ref().or(diagnosis.now.as_ref());
    match (nothing_to_add(verdict), verdict.verdict) {
        (Some(why), Kind::OutsideCatalogue | Kind::DataProblem) => {
            Err(format!("{}: nothing to fit: {why}", vehicle.name))
        }
        (Some(_), _) => with(vehicle, diagnosis, own, &[], flights),
        (None, _) => with(vehicle, diagnosis, own, &verdict.effects, flights),
    }
}

/// The vehicle file that an answer asks for, or why it asks for none.
///
/// * `with_its_numbers` - as [`fit`] has it, instead of [`add`]
///
/// # Errors
/// As [`add`].
pub fn patched(
    vehicle: &VehicleFile,
    diagnosis: &Diagnosis,
    flights: &[String],
    with_its_numbers: bool,
) -> Result<Result<String, String>, String> {
    match nothing_to_add(&diagnosis.verdict) {
        _ if with_its_numbers => Ok(fit(vehicle, diagnosis, flights)),
        Some(why) => Ok(Err(format!("{}: nothing to add: {why}", vehicle.name))),
        None => add(vehicle, diagnosis, flights).map(Ok),
    }
}

/// As [`add`], of the explanations that flights do not tell apart the first with an effect: the
/// answer, then its alternatives.
///
/// # Errors
/// One line: no explanation has the effect; or as [`add`].
pub fn add_effect(
    vehicle: &VehicleFile,
    diagnosis: &Diagnosis,
    effect: &str,
    flights: &[String],
) -> Result<String, String> {
    let verdict = &diagnosis.verdict;
    let sets = || {
        std::iter::once(&verdict.effects).chain(verdict.alternatives.iter().map(|set| &set.numbers))
    };
    let Some(chosen) = sets().find(|set| set.iter().any(|named| named.name == effect)) else {
        let mut names: Vec<&str> = sets().flatten().map(|named| named.name).collect();
        names.sort_unstable();
        names.dedup();
        let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        return Err(format!(
            "{}: no explanation of these flights has {effect:?}; they have: {names}",
            vehicle.name
        ));
    };
    with(vehicle, diagnosis, diagnosis.before.as_ref(), chosen, flights)
}

fn with(
    vehicle: &VehicleFile,
    diagnosis: &Diagnosis,
    own: Option<&Own>,
    chosen: &[NamedEffect],
    flights: &[String],
) -> Result<String, String> {
    let mut document: DocumentMut =
        vehicle.text.parse().map_err(|e| format!("{}: {e}", vehicle.name))?;
    if let Some(own) = own {
        own_rotors(&mut document, vehicle, own)?;
        own_airframe(&mut document, vehicle, own);
    }
    let effects = document.entry("effects").or_insert_with(|| {
        let mut table = Table::new();
        // Only `[effects.<name>]` headers show.
        table.set_implicit(true);
        Item::Table(table)
    });
    let Some(effects) = effects.as_table_mut() else {
        return Err(format!("{}: effects: must be a table", vehicle.name));
    };
    if let Some(own) = own {
        own_effects(effects, own);
    }
    let source = format!("gap: {}", flights.join(", "));
    let domain = domain(diagnosis);
    let mut further = Vec::new();
    for (index, effect) in chosen.iter().enumerate() {
        // A file has one table an effect: further weak rotors are numbers of those rotors.
        if chosen[..index].iter().any(|other| other.name == effect.name) {
            further.push(effect);
            continue;
        }
        let table = effects.entry(effect.name).or_insert_with(|| Item::Table(Table::new()));
        let Some(table) = table.as_table_mut() else {
            return Err(format!("{}: effects.{}: must be a table", vehicle.name, effect.name));
        };
        write_form(table, effect.name, effect.form);
        for (key, number) in &effect.parameters {
            let item = match *number {
                Value::Choice { value: name, .. } => value(name),
                Value::Number { value: x, low, high } if low == high => value(x as i64),
                Value::Number { value: x, low, high } => {
                    let mut inline = InlineTable::new();
                    inline.insert("value", rounded(x).into());
                    inline.insert("low", rounded(low).into());
                    inline.insert("high", rounded(high).into());
                    inline.insert("source", source.as_str().into());
                    inline.insert("domain", domain.as_str().into());
                    value(inline)
                }
            };
            table.insert(key, item);
        }
    }
    for effect in further {
        weaken(&mut document, vehicle, effect, &source)?;
    }
    let text = document.to_string();
    VehicleFile::parse(&text, &vehicle.name).map_err(|e| format!("the patched vehicle: {e}"))?;
    Ok(text)
}

/// Where each rotor of a machine is as flights have it, and what it gives.
fn own_rotors(document: &mut DocumentMut, vehicle: &VehicleFile, own: &Own) -> Result<(), String> {
    let (before, now) = (vehicle.vehicle.rotor_factors(), own.vehicle.vehicle.rotor_factors());
    for rotor in 0..vehicle.vehicle.rotors().len() {
        let [was, is] =
            [vehicle, &own.vehicle].map(|file| file.vehicle.rotors()[rotor].position.vector);
        if was != is {
            let position = &mut rotor_table(document, vehicle, rotor)?["position_body_m"];
            replace(position, numbers(is.as_slice()), &own.source);
        }
        for (key, which) in [("thrust_fraction", 0), ("torque_fraction", 1)] {
            if now[which][rotor] != before[which][rotor] {
                let number = with_source(now[which][rotor], &own.source);
                rotor_table(document, vehicle, rotor)?.insert(key, number);
            }
        }
    }
    Ok(())
}

/// Mass, inertia and drag of a machine as flights have it.
fn own_airframe(document: &mut DocumentMut, vehicle: &VehicleFile, own: &Own) {
    let [was, is] = [vehicle, &own.vehicle].map(|file| *file.vehicle.parameters());
    let (inertia, drag) = (is.inertia_kg_m2, is.drag.linear_n_s_per_m);
    if was.mass_kg != is.mass_kg {
        replace(&mut document["mass"]["mass_kg"], rounded(is.mass_kg), &own.source);
    }
    if was.inertia_kg_m2 != inertia {
        let diagonal = numbers(inertia.diagonal().as_slice());
        let is_full = nalgebra::Matrix3::from_diagonal(&inertia.diagonal()) != inertia;
        let rows =
            || (0..3).map(|row| numbers(&[0, 1, 2].map(|column| inertia[(row, column)]))).collect();
        let now = if is_full { rows() } else { diagonal };
        replace(&mut document["mass"]["inertia_kg_m2"], now, &own.source);
    }
    if was.drag.linear_n_s_per_m != drag {
        replace(&mut document["drag"]["linear_n_s_per_m"], numbers(drag.as_slice()), &own.source);
    }
}

fn numbers(all: &[f64]) -> Array {
    all.iter().map(|x| rounded(*x)).collect()
}

/// Replaces a number or a list of them, which keeps its sd.
fn replace(item: &mut Item, number: impl Into<toml_edit::Value>, source: &str) {
    let sd = item.get("sd").and_then(Item::as_value).cloned();
    let mut inline = InlineTable::new();
    inline.insert("value", number.into());
    if let Some(sd) = sd {
        inline.insert("sd", sd);
    }
    inline.insert("source", source.into());
    *item = value(inline);
}

/// The effects that act in all flights of a machine.
fn own_effects(effects: &mut Table, own: &Own) {
    let mut fitted = own.vehicle.effects;
    for name in Effects::<f64>::NAMES {
        let Some(found) = fitted.has(name).then(|| fitted.insert(name)).flatten() else { continue };
        let entry = effects.entry(name).or_insert_with(|| Item::Table(Table::new()));
        let Some(table) = entry.as_table_mut() else { continue };
        let form = chosen_form(found.parameters, found.values);
        for (parameter, number) in found.parameters.iter().zip(found.values.iter()) {
            match parameter.kind {
                ParameterKind::OneOf(_) if parameter.key == FORM => write_form(table, name, form),
                ParameterKind::OneOf(names) => {
                    table.insert(parameter.key, value(names[*number as usize]));
                }
                ParameterKind::Rotor => {
                    table.insert(parameter.key, value(*number as i64));
                }
                ParameterKind::Size { .. } if parameter.exists_in(form) => {
                    table.insert(parameter.key, with_source(*number, &own.source));
                }
                ParameterKind::Size { .. } => {}
            }
        }
    }
}

/// Says which form an effect has, where that is not the one which a file without a word has.
fn write_form(table: &mut Table, effect: &str, form: &'static str) {
    if form != "standard" && (form != standard_form(effect) || table.contains_key(FORM)) {
        table.insert(FORM, value(form));
    }
}

/// The form that an effect has among its numbers.
fn chosen_form(parameters: &[EffectParameter], values: &[f64]) -> &'static str {
    let chosen =
        parameters.iter().zip(values).find_map(|(parameter, number)| match parameter.kind {
            ParameterKind::OneOf(names) if parameter.key == FORM => {
                names.get(*number as usize).copied()
            }
            _ => None,
        });
    chosen.unwrap_or("standard")
}

/// A rotor gives what an effect makes of it.
fn weaken(
    document: &mut DocumentMut,
    vehicle: &VehicleFile,
    effect: &NamedEffect,
    source: &str,
) -> Result<(), String> {
    let twice = || format!("{}: {} twice: a file takes one", vehicle.name, effect.name);
    let mut alone = Effects::none();
    let found = alone.insert(effect.name).ok_or_else(twice)?;
    let form = forms(found.parameters).iter().position(|form| *form == effect.form);
    for (value, parameter) in found.values.iter_mut().zip(found.parameters) {
        *value = match effect.parameters.get(parameter.key) {
            Some(Value::Number { value, .. }) => *value,
            _ if parameter.key == FORM => form.unwrap_or(0) as f64,
            _ => return Err(twice()),
        };
    }
    let weak = alone.alter(&vehicle.vehicle).map_err(|e| format!("{}: {e}", vehicle.name))?;
    let (before, now) = (vehicle.vehicle.rotor_factors(), weak.rotor_factors());
    for rotor in 0..vehicle.vehicle.rotors().len() {
        for (which, key) in ["thrust_fraction", "torque_fraction"].into_iter().enumerate() {
            if now[which][rotor] == before[which][rotor] {
                continue;
            }
            let table = rotor_table(document, vehicle, rotor)?;
            let had = match table.get(key) {
                Some(item) => item.get("value").unwrap_or(item).as_float().unwrap_or(1.0),
                None => 1.0,
            };
            let gives = had * now[which][rotor] / before[which][rotor];
            table.insert(key, with_source(gives, source));
        }
    }
    Ok(())
}

fn rotor_table<'a>(
    document: &'a mut DocumentMut,
    vehicle: &VehicleFile,
    rotor: usize,
) -> Result<&'a mut Table, String> {
    let tables = document.get_mut("rotor").and_then(Item::as_array_of_tables_mut);
    let table = tables.and_then(|tables| tables.get_mut(rotor));
    table.ok_or_else(|| format!("{}: rotor[{rotor}]: must be a table `[[rotor]]`", vehicle.name))
}

fn with_source(number: f64, source: &str) -> Item {
    let mut inline = InlineTable::new();
    inline.insert("value", rounded(number).into());
    inline.insert("source", source.into());
    value(inline)
}

fn standard_form(effect: &str) -> &'static str {
    let list = Effects::<f64>::parameters(effect).unwrap_or_default();
    forms(list).first().copied().unwrap_or("standard")
}

/// Six digits are more than any interval needs.
fn rounded(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

/// What the flights covered, in one line.
pub(crate) fn domain(diagnosis: &Diagnosis) -> String {
    let mut text = String::new();
    for covered in &diagnosis.domain {
        let comma = if text.is_empty() { "" } else { ", " };
        let _ = write!(
            text,
            "{comma}{} {:.2} to {:.2} {}",
            covered.name, covered.low, covered.high, covered.unit
        );
    }
    text
}

/// The lines that a patch adds, removes or changes, with `+` and `-` before them.
pub fn difference(before: &str, after: &str) -> String {
    let (old, new): (Vec<&str>, Vec<&str>) = (before.lines().collect(), after.lines().collect());
    let mut text = String::new();
    let (mut i, mut j) = (0, 0);
    while i < old.len() || j < new.len() {
        if i < old.len() && j < new.len() && old[i] == new[j] {
            (i, j) = (i + 1, j + 1);
        } else if let Some(ahead) =
            old.get(i).and_then(|line| new[j..].iter().position(|n| n == line))
        {
            // A line that comes again later: everything until then is new.
            for line in &new[j..j + ahead] {
                let _ = writeln!(text, "+ {line}");
            }
            j += ahead;
        } else if i < old.len() {
            let _ = writeln!(text, "- {}", old[i]);
            i += 1;
        } else {
            let _ = writeln!(text, "+ {}", new[j]);
            j += 1;
        }
    }
    text
}
