//! The image for an STM32H747: tasks around the flight code. Built and sized, never flown.
//!
//! `fly` runs 300 times a second: IMU, step, motor controllers, servos, log; core's outer loop is
//! every thirtieth step, so that the bits are those of the simulator. `arm` runs ten times a
//! second. The others wait for their sensor, or for something to log. All of them share one
//! executor, without priorities: none computes for longer than some tens of microseconds at a time.
//!
//! The lamp: off is disarmed, slow blinking ready, lit armed, fast blinking a board that cannot fly
//! (no setup, or no IMU).

#![no_std]
#![no_main]

mod board;

use bmp390_rs::config::Configuration;
use bmp390_rs::register::odr::OutputDataRate;
use bmp390_rs::register::osr::Oversampling;
use bmp390_rs::register::pwr_ctrl::PowerMode;
use bmp390_rs::{Bmp390, ResetPolicy, SdoPinState};
use board::{Actuators, Board, Lamp, Switch};
use core::cell::Cell;
use cortex_m::peripheral::SCB;
use embassy_embedded_hal::shared_bus::asynch::spi::SpiDevice;
use embassy_executor::Spawner;
use embassy_stm32::gpio::Output;
use embassy_stm32::i2c::{self, I2c};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::IWDG1;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::usart::{UartRx, UartTx};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_sync::blocking_mutex::Mutex as Shared;
use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, NoopRawMutex};
use embassy_sync::mutex::Mutex;
use embassy_sync::pipe::Pipe;
use embassy_sync::signal::Signal;
use embassy_time::{Delay, Duration, Instant, Ticker, Timer};
use icm426xx::ICM42688;
use squirrel_core::frames::{Body, In};
use squirrel_core::stack::failsafe::FailsafeMode;
use squirrel_h747::arming::{Arming, Inputs, State};
use squirrel_h747::flight::Flight;
use squirrel_h747::gnss::{Fix, Receiver};
use squirrel_h747::log::{LINE_MAX, framed};
use squirrel_h747::sensors::Sensors;
use squirrel_h747::setup;
use static_cell::StaticCell;

const STEP: Duration = Duration::from_hz(300);
const ARMING_STEP: Duration = Duration::from_hz(10);
const PRESSURE_STEP: Duration = Duration::from_hz(50);
/// Samples of the IMU, at 1 kHz, that a step takes at most: more are old.
const SAMPLES_MAX: u16 = 8;

/// What the arming task decided, and what it decides by.
static ARMED: Shared<CriticalSectionRawMutex, Cell<State>> =
    Shared::new(Cell::new(State::Disarmed));
static STATUS: Shared<CriticalSectionRawMutex, Cell<(bool, FailsafeMode)>> =
    Shared::new(Cell::new((false, FailsafeMode::Off)));
static FIX: Signal<CriticalSectionRawMutex, (Fix, u64)> = Signal::new();
static PRESSURE_PA: Signal<CriticalSectionRawMutex, (f32, u64)> = Signal::new();
/// 0.2 s of log, or a setup.
static LOG: Pipe<CriticalSectionRawMutex, 8192> = Pipe::new();

/// The bus of the IMU, which tasks borrow for as long as the program runs.
static BUS: StaticCell<Mutex<NoopRawMutex, Spi<'static, Async, spi::mode::Master>>> =
    StaticCell::new();

type Imu = ICM42688<
    SpiDevice<'static, NoopRawMutex, Spi<'static, Async, spi::mode::Master>, Output<'static>>,
    icm426xx::Ready,
>;

/// A board that fails starts anew, disarmed; motor controllers stop when nobody speaks to them.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    SCB::sys_reset()
}

fn or_reset<T, E>(result: Result<T, E>) -> T {
    result.unwrap_or_else(|_| SCB::sys_reset())
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let Some(board) = board::start() else { SCB::sys_reset() };
    let Board { actuators, imu, imu_select, gnss, barometer, log, switch, lamp, watchdog } = board;
    let device = SpiDevice::new(&*BUS.init(Mutex::new(imu)), imu_select);
    let config = icm426xx::Config { rate: icm426xx::OutputDataRate::Hz1000, ..Default::default() };
    let imu = ICM42688::new(device).initialize(Delay, config).await;
    let flight = setup::read(board::setup()).and_then(Flight::new);
    let (Ok(imu), Some(flight)) = (imu, flight) else { return cannot_fly(lamp).await };
    spawner.spawn(or_reset(listen(gnss)));
    spawner.spawn(or_reset(weigh_air(barometer)));
    spawner.spawn(or_reset(tell(log)));
    spawner.spawn(or_reset(arm(switch, lamp)));
    spawner.spawn(or_reset(fly(imu, flight, actuators, watchdog)));
}

/// Blinks fast, for ever.
async fn cannot_fly(mut lamp: Lamp) {
    let mut ticker = Ticker::every(ARMING_STEP);
    for lit in [true, false].into_iter().cycle() {
        lamp.set(lit);
        ticker.next().await;
    }
}

/// 300 Hz: sensors, step, outputs, log.
#[embassy_executor::task]
async fn fly(
    mut imu: Imu,
    mut flight: Flight,
    mut actuators: Actuators,
    mut watchdog: IndependentWatchdog<'static, IWDG1>,
) {
    let mut sensors = Sensors::new(board::HEADING_AT_ARMING_RAD);
    let mut ticker = Ticker::every(STEP);
    watchdog.unleash();
    loop {
        ticker.next().await;
        if let Some((omega, specific_force)) = samples(&mut imu).await {
            sensors.imu(omega, specific_force, Instant::now().as_micros());
        }
        if let Some((fix, time_us)) = FIX.try_take() {
            sensors.fix(fix, time_us);
        }
        if let Some((pressure_pa, time_us)) = PRESSURE_PA.try_take() {
            sensors.pressure(pressure_pa, time_us);
        }
        let now_us = Instant::now().as_micros();
        let outputs = flight.step(ARMED.lock(Cell::get), &mut sensors, now_us, keep);
        actuators.write(&outputs).await;
        STATUS.lock(|status| status.set((sensors.are_ready(now_us), flight.failsafe())));
        watchdog.pet();
    }
}

/// Mean of the samples since the last step, in the body frame: rad/s, m/s^2. `None` where there is
/// none.
async fn samples(imu: &mut Imu) -> Option<(In<Body, f32>, In<Body, f32>)> {
    let (mut omega, mut force, mut count) = (In::zero(), In::zero(), 0u16);
    while count < SAMPLES_MAX {
        match imu.read_sample().await {
            Ok(Some((sample, is_more))) => {
                if let (Some(gyro), Some(accel)) = (sample.gyro, sample.accel) {
                    (omega, force) = (omega + board::body(gyro), force + board::body(accel));
                    count += 1;
                }
                if !is_more {
                    break;
                }
            }
            Ok(None) => break,
            Err(_) => {
                // What overflowed is old. Where that fails too, the sensor is silent, and the
                // failsafe counts.
                let _ = imu.reset_fifo().await;
                return None;
            }
        }
    }
    let share = 1.0 / f32::from(count);
    (count > 0).then(|| (omega * share, force * share))
}

/// Puts a record on the line, whole or not at all: where the line cannot follow, the host misses
/// records and sees it.
fn keep(record: &[u8]) {
    let mut line = [0; LINE_MAX];
    if let Some(bytes) = framed(record, &mut line)
        && LOG.free_capacity() >= bytes.len()
    {
        let mut rest = bytes;
        while let Ok(written) = LOG.try_write(rest) {
            rest = rest.get(written..).unwrap_or(&[]);
            if rest.is_empty() {
                break;
            }
        }
    }
}

/// 10 Hz: switch, arming, lamp.
#[embassy_executor::task]
async fn arm(switch: Switch, mut lamp: Lamp) {
    let mut arming = Arming::default();
    let mut ticker = Ticker::every(ARMING_STEP);
    for tick in (0..10u8).cycle() {
        ticker.next().await;
        let (ready, failsafe) = STATUS.lock(Cell::get);
        let inputs = Inputs {
            time_us: Instant::now().as_micros(),
            switch_on: switch.is_on(),
            ready,
            failsafe,
        };
        let state = arming.update(&inputs);
        ARMED.lock(|armed| armed.set(state));
        lamp.set(match state {
            State::Armed { .. } => true,
            State::Disarmed => ready && tick < 5,
            State::Ended => false,
        });
    }
}

/// Fixes from the receiver.
#[embassy_executor::task]
async fn listen(gnss: UartRx<'static, Async>) {
    let mut ring = [0; 512];
    let mut gnss = gnss.into_ring_buffered(&mut ring);
    let mut receiver = Receiver::default();
    let mut bytes = [0; 128];
    loop {
        match gnss.read(&mut bytes).await {
            Ok(count) => {
                if let Some(fix) = receiver.read(bytes.get(..count).unwrap_or(&[])) {
                    FIX.signal((fix, Instant::now().as_micros()));
                }
            }
            // The parser finds its way; a line of noise must not keep the others from running.
            Err(_) => Timer::after_millis(1).await,
        }
    }
}

/// Pressure, 50 times a second. A barometer that does not answer is asked again.
#[embassy_executor::task]
async fn weigh_air(mut bus: I2c<'static, Async, i2c::Master>) {
    loop {
        let config = Configuration::default()
            .enable_pressure_measurement(true)
            .enable_temperature_measurement(true)
            .power_mode(PowerMode::Normal)
            .output_data_rate(OutputDataRate::R50Hz)
            .pressure_oversampling(Oversampling::X8);
        let sensor =
            Bmp390::new_i2c(&mut bus, SdoPinState::Low, config, ResetPolicy::Soft, &mut Delay)
                .await;
        if let Ok(mut sensor) = sensor {
            let mut ticker = Ticker::every(PRESSURE_STEP);
            while let Ok(measured) = sensor.read_sensor_data().await {
                PRESSURE_PA.signal((measured.pressure(), Instant::now().as_micros()));
                ticker.next().await;
            }
        }
        Timer::after(PRESSURE_STEP).await;
    }
}

/// The log, as fast as the line is.
#[embassy_executor::task]
async fn tell(mut line: UartTx<'static, Async>) {
    let mut bytes = [0; 256];
    loop {
        let count = LOG.read(&mut bytes).await;
        // A byte that is lost costs a record.
        let _ = line.write(bytes.get(..count).unwrap_or(&[])).await;
    }
}
