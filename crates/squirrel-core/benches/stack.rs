//! One inner and one outer step of the flight code.

#[path = "../tests/airframe/mod.rs"]
mod airframe;

use airframe::{PAPER_SIGNS, PAPER_X, vehicle};
use criterion::{Criterion, criterion_group, criterion_main};
use squirrel_core::control::backstepping::{AttitudeForm, AttitudeGains};
use squirrel_core::control::position::{AngleLaw, PositionGains};
use squirrel_core::control::supply::ThrustByVoltage;
use squirrel_core::control::twcc::{Trigger, TwccParameters, WingPolicy};
use squirrel_core::control::wiic::ThrustLaw;
use squirrel_core::control::wing_force::ForceModel;
use squirrel_core::control::woeg::{WingEvents, WingTest};
use squirrel_core::estimate::navigator::Navigation;
use squirrel_core::frames::{In, Rotation};
use squirrel_core::guidance::mission::Mission;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::rnn::elman::Elman;
use squirrel_core::rnn::parnn::{Domain, Parnn, WINDOW};
use squirrel_core::stack::{
    Gnss, Imu, OUTER_PERIOD_US, SensorFrame, Stack, StackParameters, StackState,
};
use std::hint::black_box;

fn stack(form: AttitudeForm, force_model: &ForceModel) -> Stack {
    let vehicle = vehicle(&PAPER_X, &PAPER_SIGNS);
    let attitude = AttitudeGains {
        form,
        c1_per_s: Vector3::new(9.0, 9.0, 4.0),
        c2_per_s: Vector3::new(14.0, 14.0, 5.0),
        lambda_per_s2: Vector3::new(8.0, 8.0, 2.0),
        integral_max_rad_s: 0.1,
        rotor_lead: 1.0,
        filter_frequency_rad_s: 20.0,
        filter_damping: 1.0,
    };
    let twcc = TwccParameters {
        position: PositionGains {
            position_per_s: Vector3::new(1.6, 1.6, 0.8),
            velocity_per_s: Vector3::new(2.5, 2.5, 1.6),
            integral_per_s2: Vector3::repeat(0.15),
            derivative: Vector3::repeat(0.05),
            velocity_feed_forward: 0.0,
            acceleration_feed_forward: 0.0,
            approach_max_m_s2: f32::INFINITY,
            speed_max_m_s: f32::INFINITY,
            acceleration_max_horizontal_m_s2: 11.0,
            acceleration_max_vertical_m_s2: 3.0,
            integral_max_m: 2.0,
            angle_law: AngleLaw::Exact,
        },
        wing_events: WingEvents { test: WingTest::Normal, open_above_n: 0.1, close_below_n: 0.05 },
        thrust_law: ThrustLaw::Exact,
        trigger: Trigger::Angle,
        force_model: *force_model,
        policy: WingPolicy::Coordinated,
        dwell_s: 0.3,
        thrust_min_n: 0.5,
        plus: None,
    };
    Stack::new(
        vehicle,
        StackParameters {
            attitude,
            twcc,
            navigation: Navigation::external(),
            thrust: ThrustByVoltage::CONSTANT,
        },
        Mission::Hover { position: In::zero() },
    )
    .expect("sound")
}

fn frame(time_us: u64) -> SensorFrame {
    let mut frame = SensorFrame::empty(time_us);
    frame.imu = Some(Imu {
        omega: In::new(Vector3::new(0.1, -0.2, 0.05)),
        specific_force: In::new(Vector3::new(0.1, 0.0, -9.8)),
    });
    frame.attitude = Some(Rotation::from_euler(0.1, 0.4, 0.02));
    frame.gnss = Some(Gnss {
        position: In::new(Vector3::new(1.0, 0.5, 0.1)),
        velocity: In::new(Vector3::new(6.0, 1.0, 0.2)),
    });
    frame
}

fn steps(c: &mut Criterion) {
    // What a weight is does not change the time.
    let domain = Domain { speed_m_s: [0.0, 10.0], alpha_rad: [-1.0, 1.0] };
    let parnn = ForceModel::Parnn(Parnn { net: Elman::filled(0.1), area_m2: 0.04, domain });
    let plate = ForceModel::FlatPlate;
    for (name, form, model) in [
        ("euler", AttitudeForm::Euler, &plate),
        ("quaternion", AttitudeForm::Quaternion, &plate),
        ("quaternion_parnn", AttitudeForm::Quaternion, &parnn),
    ] {
        let stack = stack(form, model);
        let mut ready = StackState::default();
        // Until the network's window is full.
        for tick in 0..WINDOW as u64 {
            stack.step(&mut ready, &frame(tick * OUTER_PERIOD_US));
        }
        let now_us = WINDOW as u64 * OUTER_PERIOD_US;
        c.bench_function(&format!("inner_step_{name}"), |b| {
            b.iter(|| {
                let mut state = ready;
                stack.step(&mut state, black_box(&frame(now_us - 96_667)))
            });
        });
        c.bench_function(&format!("inner_and_outer_step_{name}"), |b| {
            b.iter(|| {
                let mut state = ready;
                stack.step(&mut state, black_box(&frame(now_us)))
            });
        });
    }
}

criterion_group!(benches, steps);
criterion_main!(benches);
