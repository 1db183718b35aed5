use super::*;
use crate::vehicle_file::SQUIRREL_TOML;

fn practice(effects: &str) -> VehicleFile {
    let text = squirrel_vehicles::CRAZYFLIE21_DATASHEET;
    VehicleFile::parse(&format!("{text}\n{effects}"), "cf").unwrap()
}

#[test]
fn what_a_target_has_is_what_the_plant_does() {
    // Drag alike along x, y and z, no area, one lag: every term is there but ArduPilot's lag.
    let text = practice("").text.replace("[0.007, 0.007, 0.008]", "[0.007, 0.007, 0.007]");
    let file = VehicleFile::parse(&text, "cf").unwrap();
    for (name, target) in Target::ALL {
        assert_eq!(Target::parse(name), Ok(target));
        let exported = export(&file, target).unwrap();
        let Remains { hover, forward_5_m_s, sideways_5_m_s, climb_2_m_s } = exported.remains;
        for error in [hover, forward_5_m_s, sideways_5_m_s] {
            assert!(error.force_n < 1e-9 && error.moment_n_m < 1e-9, "{name}: {error:?}");
        }
        let has_z = !matches!(target, Target::Sdf | Target::ArdupilotJson);
        assert_eq!(climb_2_m_s.force_n < 1e-9, has_z, "{name}: {climb_2_m_s:?}");
        let what: Vec<&str> = exported.lost.iter().map(|lost| lost.what.as_str()).collect();
        let expected: &[&str] = match target {
            Target::Sdf => &["drag.linear_n_s_per_m"],
            Target::ArdupilotJson => &["propulsion.time_constant_s", "drag.linear_n_s_per_m"],
            _ => &[],
        };
        assert_eq!(what, expected, "{name}");
    }
}

#[test]
fn what_a_target_has_not_is_named_with_its_size() {
    let file = practice(
        "[effects.flapping_moment]\ngain_n_m_s_per_m = 2e-5\n\
         [effects.weak_rotor]\nrotor = 2\nthrust_loss_fraction = 0.1\n\
         [effects.gnss_latency]\nlatency_s = 0.1\n",
    );
    let of = |target| export(&file, target).unwrap();
    let rotorpy = of(Target::Rotorpy);
    let what: Vec<&str> = rotorpy.lost.iter().map(|lost| lost.what.as_str()).collect();
    assert_eq!(what, ["effects.gnss_latency", "effects.weak_rotor"]);
    assert!(rotorpy.lost[0].size.is_none());
    let [hover, _] = rotorpy.lost[1].size.unwrap();
    // A tenth of a quarter of the weight, as rotors at one speed share it.
    assert!((hover.force_n / (0.1 * 0.2648 / 3.9) - 1.0).abs() < 0.01, "{hover:?}");
    assert!(rotorpy.remains.hover.moment_n_m > 1e-4);
    let mjcf = of(Target::Mjcf);
    let [_, forward] =
        mjcf.lost.iter().find(|l| l.what == "effects.flapping_moment").unwrap().size.unwrap();
    assert!((forward.moment_n_m - 1e-4).abs() < 1e-9, "{forward:?}");
    assert!(!mjcf.lost.iter().any(|l| l.what == "effects.weak_rotor"));
    assert!(mjcf.remains.hover.moment_n_m < 1e-12);
}

/// RotorPy has drag at the hubs: then it may damp turning, and elsewhere something is lost.
#[test]
fn what_acts_at_the_rotors_does_so_in_rotorpy() {
    let drag = "[effects.linear_drag]\nextra_drag_n_s_per_m = 0.01\nextra_drag_z_n_s_per_m = 0.0\nform = \"at_rotors\"\n";
    let bare = practice("").text.replace("[0.007, 0.007, 0.008]", "[0.0, 0.0, 0.0]");
    let file = VehicleFile::parse(&format!("{bare}\n{drag}"), "cf").unwrap();
    let rotorpy = export(&file, Target::Rotorpy).unwrap();
    assert!(rotorpy.lost.is_empty(), "{:?}", rotorpy.lost);
    assert!(!rotorpy.text.contains("np.zeros(3), rotor_speeds"), "{}", rotorpy.text);
    assert!(rotorpy.remains.forward_5_m_s.force_n < 1e-9, "{:?}", rotorpy.remains);
    let mixed = export(&practice(drag), Target::Rotorpy).unwrap();
    assert!(mixed.lost[0].why.contains("damp turning"), "{:?}", mixed.lost);
    let crazyflow = export(&file, Target::Crazyflow).unwrap();
    assert!(crazyflow.lost[0].why.contains("damps no turning"), "{:?}", crazyflow.lost);
}

#[test]
fn effects_in_numbers_go_everywhere() {
    let file = practice(
        "[effects.mass_error]\nmass_fraction = 0.1\n[effects.inertia_error]\naxis = \"y\"\ninertia_fraction = 0.2\n\
         [effects.cg_offset]\ncg_x_m = 0.002\ncg_y_m = -0.001\n[effects.thrust_coefficient]\nthrust_fraction = -0.1\n",
    );
    for (name, target) in Target::ALL {
        let exported = export(&file, target).unwrap();
        assert!(!exported.lost.iter().any(|l| l.what.starts_with("effects")), "{name}");
        assert!(exported.remains.hover.force_n < 1e-9, "{name}: {:?}", exported.remains);
        assert!(exported.remains.hover.moment_n_m < 1e-9, "{name}: {:?}", exported.remains);
        // Of Gazebo's mass the rotors have a part.
        assert!(target == Target::Sdf || exported.text.contains("0.0297"), "{name}");
    }
}

/// An inertia that no body has: some targets take it, those that refuse it are not written for.
#[test]
fn an_inertia_that_no_body_has_is_named() {
    let effect = "[effects.inertia_error]\naxis = \"z\"\ninertia_fraction = 0.5\n";
    let text =
        SQUIRREL_TOML.replace("value = [3.22e-3, 4.68e-3, 7.72e-3]", "value = [3e-3, 3e-3, 5e-3]");
    let file = VehicleFile::parse(&format!("{text}\n{effect}"), "squirrel").unwrap();
    for target in [Target::Mjcf, Target::Sdf] {
        let error = export(&file, target).unwrap_err();
        assert!(error.starts_with("mass.inertia_kg_m2: its largest moment, 7.5"), "{error}");
    }
    assert!(export(&file, Target::Px4Params).is_ok());
}

#[test]
fn files_are_well_formed() {
    let squirrel = VehicleFile::parse(SQUIRREL_TOML, "squirrel").unwrap();
    let text = |target| export(&squirrel, target).unwrap().text;
    let frame: serde_json::Value = serde_json::from_str(&text(Target::ArdupilotJson)).unwrap();
    assert_eq!(frame["num_motors"], 4.0);
    assert_eq!(frame["motor1_position"][1], -0.085);
    assert_eq!(frame["moment_inertia"][2], 7.72e-3);
    let flow: toml::Table = text(Target::Crazyflow).parse().unwrap();
    let drone = flow["squirrel"].as_table().unwrap();
    assert_eq!(drone["mass"].as_float(), Some(0.548));
    for line in text(Target::Px4Params).lines().filter(|line| !line.starts_with('#')) {
        let cells: Vec<&str> = line.split('\t').collect();
        assert_eq!(cells.len(), 5, "{line}");
        cells[3].parse::<f64>().unwrap();
        assert!(cells[2].len() <= 16, "{line}: a name of MAVLink has 16 characters");
        assert!(matches!(cells[4], "6" | "9"), "{line}");
    }
    for target in [Target::Sdf, Target::Mjcf] {
        let text = text(target);
        // Every tag that opens closes: counted by name.
        let mut open = Vec::new();
        for tag in text.split('<').skip(1) {
            let tag = tag.split('>').next().unwrap();
            if tag.starts_with('?') || tag.starts_with('!') || tag.ends_with('/') {
                continue;
            }
            match tag.strip_prefix('/') {
                Some(name) => assert_eq!(open.pop(), Some(name.to_owned()), "{target:?}"),
                None => open.push(tag.split_whitespace().next().unwrap().to_owned()),
            }
        }
        assert!(open.is_empty(), "{target:?}: {open:?}");
    }
    let lost = export(&squirrel, Target::Sdf).unwrap().lost;
    assert!(lost.iter().any(|l| l.what == "wing"), "{lost:?}");
    let hexa = SQUIRREL_TOML.replacen(
        "[propulsion]",
        "[[rotor]]\nposition_body_m = [0.0, 0.1, 0.0]\nyaw_sign = 1\n[propulsion]",
        1,
    );
    let hexa = VehicleFile::parse(&hexa, "five").unwrap();
    for target in [Target::Crazyflow, Target::Rotorpy] {
        assert!(export(&hexa, target).unwrap_err().contains("5 rotors"), "{target:?}");
    }
}

/// Two hyphens in a row end a comment of XML.
#[test]
fn a_name_ends_no_comment() {
    let text = SQUIRREL_TOML.replacen("name = \"squirrel\"", "name = \"a---b\"", 1);
    let file = VehicleFile::parse(&text, "a---b").unwrap();
    for target in [Target::Sdf, Target::Mjcf] {
        let text = export(&file, target).unwrap().text;
        assert!(text.contains("=\"a---b\""), "{target:?}: its name elsewhere");
        for comment in text.split("<!--").skip(1) {
            let comment = comment.split("-->").next().unwrap();
            assert!(!comment.contains("--") && !comment.ends_with('-'), "{target:?}: {comment}");
        }
    }
}

/// Rotors are links of their own there: with the body they must weigh and turn as the vehicle does.
#[test]
fn links_of_sdf_add_up_to_the_vehicle() {
    let squirrel = VehicleFile::parse(SQUIRREL_TOML, "squirrel").unwrap();
    let text = export(&squirrel, Target::Sdf).unwrap().text;
    let number = |link: &str, tag: &str| -> Vec<f64> {
        let inside = link.split(&format!("<{tag}>")).nth(1).unwrap().split('<').next().unwrap();
        inside.split_whitespace().map(|x| x.parse().unwrap()).collect()
    };
    let (mut mass, mut inertia) = (0.0, [0.0; 3]);
    for (i, link) in text.split("<link ").skip(1).enumerate() {
        let own = number(link, "mass")[0];
        let place = if i == 0 { vec![0.0; 6] } else { number(link, "pose") };
        mass += own;
        let [x, y, z] = [place[0], place[1], place[2]];
        let beside = [y * y + z * z, x * x + z * z, x * x + y * y];
        for (axis, tag) in ["ixx", "iyy", "izz"].into_iter().enumerate() {
            inertia[axis] += number(link, tag)[0] + own * beside[axis];
        }
    }
    assert!((mass - 0.548).abs() < 1e-8, "{mass}");
    for (axis, truth) in [3.22e-3, 4.68e-3, 7.72e-3].into_iter().enumerate() {
        // A rotor's own is what the body keeps.
        assert!((inertia[axis] / truth - 1.0).abs() < 1e-3, "{inertia:?}");
    }
}
