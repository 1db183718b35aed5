//! Ten thousand flights in which a sensor fails: outputs stay inside limits, the failsafe says why,
//! and control comes back.

use squirrel_core::stack::StackState;
use squirrel_core::stack::failsafe::{Failsafe, FailsafeReason as Reason, RECOVERY_US};
use squirrel_log::flight_code::frames;
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::faults::{Fault, Sensor, SensorFaultKind};
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// What must be reported, where the window is long enough: the reason and after which time, us.
///
/// A sensor that hangs in flight contradicts itself only once the flight would have changed it; the
/// core tests say when.
fn expected(fault: &Fault) -> Option<(Reason, u64)> {
    let silent = fault.kind != SensorFaultKind::Stuck;
    match fault.sensor {
        Sensor::Imu if silent => Some((Reason::ImuLost, 100_000)),
        // At 300 Hz, noise and all.
        Sensor::Imu => Some((Reason::ImuStuck, 334_000)),
        Sensor::Attitude if silent => Some((Reason::AttitudeLost, 250_000)),
        Sensor::Gnss if silent => Some((Reason::GnssLost, 1_500_000)),
        Sensor::Altitude if silent => Some((Reason::AltitudeLost, 1_000_000)),
        // The first of them that is missed.
        Sensor::All
            if matches!(fault.kind, SensorFaultKind::NotANumber | SensorFaultKind::Infinite) =>
        {
            Some((Reason::ImuLost, 100_000))
        }
        _ => None,
    }
}

#[test]
fn ten_thousand_faults_are_survived_and_named() {
    let mut vehicle = VehicleFile::squirrel();
    // What is done about each sensor by itself: filters are in the study of faults.
    vehicle.estimator = Estimator::External;
    let setup = Setup {
        vehicle,
        arm: Arm::TwccParnn,
        scenario: Scenario::find("avoid").unwrap(),
        integrator: Integrator::Rk4,
    };
    let log = setup.fly(true, |_| {}).unwrap().log.unwrap();
    let flight = frames(&log).unwrap();
    let stack = setup.stack().unwrap();
    let (mut named, mut acted) = (0, 0);
    for seed in 0..10_000 {
        let (fault, broken) = Fault::draw(&flight, seed).unwrap();
        let mut state = StackState::default();
        let (mut reasons, mut last) = (Vec::new(), Failsafe::default());
        for frame in &broken {
            let output = stack.step(&mut state, frame);
            let at = frame.time_us;
            for u in &output.rotor_command[..4] {
                assert!((0.0..=1.0).contains(u), "{seed}: {fault:?}: {at}: {output:?}");
            }
            for wing in output.wing_command {
                assert!((0.0..=1.0).contains(&wing), "{seed}: {fault:?}: {at}: {output:?}");
            }
            if let Some(inner) = &output.inner {
                let torque = inner.demand.torque_n_m;
                assert!(
                    inner.demand.thrust_n.is_finite() && torque.iter().all(|x| x.is_finite()),
                    "{seed}: {at}"
                );
            }
            // A receiver speaks ten times a second, so its age may reach up to a period beyond the
            // fault.
            let well = at < fault.start_us
                || at > fault.end_us + 100_000 + u64::from(RECOVERY_US) + 10_000;
            if well {
                assert_eq!(output.failsafe, Failsafe::default(), "{seed}: {fault:?}: {at}");
            }
            if output.failsafe != last {
                reasons.push(output.failsafe.reason);
                last = output.failsafe;
            }
        }
        acted += u32::from(!reasons.is_empty());
        let window_us = fault.end_us - fault.start_us;
        let silent_us = if fault.kind == SensorFaultKind::Late { window_us / 2 } else { window_us };
        if let Some((reason, after_us)) = expected(&fault)
            && silent_us > after_us + 110_000
        {
            assert!(reasons.contains(&reason), "{seed}: {fault:?}: {reasons:?}");
            named += 1;
        }
    }
    // Of 25 pairs of sensor and kind about half must be named in half of their windows.
    assert!(named > 3000 && acted > named, "{named} named, {acted} acted");
}
