//! The pages of the studies of controllers: the same study gives the same bytes, and every arm and
//! figure is there.

use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::journal::Keep;
use squirrel_study::{forest, steering, table3, thrust};

fn plan(arms: &[Arm]) -> Plan {
    Plan::calm(VehicleFile::squirrel(), arms.to_vec(), 1, 1)
}

/// Drawings and tables hold numbers only, and there are so many figures.
fn check(page: &str, figures: usize, arms: &[Arm]) {
    // The script at the end speaks of what is no number.
    let page = page.split("<script>").next().unwrap();
    assert_eq!(page.matches("<figure>").count(), figures);
    assert!(!page.contains("NaN") && !page.contains("class=\"missing\""));
    for arm in arms {
        assert!(page.contains(&format!("</i>{}</td>", arm.name())), "no row of {}", arm.name());
    }
}

#[test]
fn the_forest_has_a_map_an_arm() {
    let plan = plan(&[Arm::Pc, Arm::TwccPlus]);
    let study = forest::run(&plan, 2.0, &Keep::default()).unwrap().unwrap();
    let page = forest::page(&study, &plan).unwrap();
    // Phantom flies in any case; two charts of success.
    check(&page, 3 + 2, &[Arm::Pc, Arm::Phantom, Arm::TwccPlus]);
    assert_eq!(page, forest::page(&study, &plan).unwrap());
    let ends = |through: bool| {
        study.rows.iter().flat_map(|row| &row.ends).filter(|end| end.through == through).count()
    };
    // Strokes of every end: four for an X, one for an O.
    let strokes = |class: &str| {
        let begin = format!("<path class=\"{class}\" d=\"");
        let paths = page.split(&begin).skip(1);
        paths.map(|path| path.split('"').next().unwrap().matches('M').count()).sum::<usize>()
    };
    assert_eq!((strokes("line limit"), strokes("line ref")), (4 * ends(false), ends(true)));
}

#[test]
fn steering_has_its_wheels_and_the_tracks_of_one_cell() {
    let plan = plan(&[Arm::TwccParnn, Arm::PcPlus]);
    let study = steering::run(&plan, &Keep::default()).unwrap().unwrap();
    let page = steering::page(&study, &plan).unwrap();
    // Two sections of wheels by plant, ratio, angle and speed; the scene, and a track each of pc
    // and twcc_parnn.
    check(&page, 2 * 8 + 1 + 2, &[Arm::Pc, Arm::TwccParnn, Arm::PcPlus]);
    assert_eq!(page, steering::page(&study, &plan).unwrap());
}

#[test]
fn the_real_flights_and_the_ratios_have_their_figures() {
    let plan = plan(&[Arm::TwccPlus, Arm::PcPlus]);
    let arms = [Arm::Pc, Arm::TwccPlus, Arm::PcPlus];
    let study = table3::run(&plan, &Keep::default()).unwrap().unwrap();
    let page = table3::page(&study, &plan).unwrap();
    check(&page, table3::THRUST_TO_WEIGHT.len() + 1 + 3, &arms);
    assert_eq!(page, table3::page(&study, &plan).unwrap());
    let study = thrust::run(&plan, &Keep::default()).unwrap().unwrap();
    let page = thrust::page(&study);
    // Gain over pc, gain over pc_plus and height: by the limit where it is scarce, by the limit, by
    // the battery.
    check(&page, 9, &arms);
    assert_eq!(page, thrust::page(&study));
}
