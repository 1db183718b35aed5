//! The wiring: every pin, timer, bus, DMA channel and rate of the board, and nothing else.
//!
//! | what | where |
//! |---|---|
//! | rotors 1 to 4, DShot300 | TIM1 CH1 to CH4: PE9, PE11, PE13, PE14; bursts by DMA1 channel 0 |
//! | left and right wing's servo, 50 Hz | TIM3 CH1 and CH2: PC6, PC7 |
//! | IMU ICM-42688-P | SPI1: SCK PA5, MISO PA6, MOSI PA7, CS PA4; DMA1 channels 1 and 2 |
//! | GNSS receiver, UBX `NAV-PVT` at 5 to 10 Hz | USART3 RX: PD9, 115200 baud; DMA1 channel 3 |
//! | barometer BMP390, SDO low | I2C1: SCL PB8, SDA PB9; DMA1 channels 4 and 5 |
//! | log | USART1 TX: PA9, 921600 baud; DMA1 channel 6 |
//! | arming switch, to ground is on | PE2, pulled up |
//! | lamp, low is on | PI12 |
//! | time of the executor | TIM5 |
//!
//! The IMU lies with its x axis forward and its z axis up. The vehicle's setup is in the last
//! sector of flash. 400 MHz: with its own step-down converter as supply the part does not reach
//! 480.

use core::mem::MaybeUninit;
use embassy_stm32::bind_interrupts;
use embassy_stm32::gpio::{Input, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::i2c::{self, I2c};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{
    DMA1_CH0, DMA1_CH1, DMA1_CH2, DMA1_CH3, DMA1_CH4, DMA1_CH5, DMA1_CH6, I2C1, TIM1, TIM3, USART3,
};
use embassy_stm32::rcc;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::Channel;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_stm32::usart::{self, UartRx, UartTx};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, Peri, SharedData, dma};
use squirrel_core::frames::{Body, In};
use squirrel_core::nalgebra::Vector3;
use squirrel_h747::flight::Outputs;
use squirrel_h747::outputs::{DSHOT_BIT_HZ, dshot_waveform};

/// How the vehicle must stand at arming, rad clockwise from north: nothing on this board measures a
/// heading.
pub(crate) const HEADING_AT_ARMING_RAD: f32 = 0.0;
/// Setup of the flight code: the last sector of the second bank.
const SETUP_ADDRESS: usize = 0x081E_0000;
const SETUP_LENGTH: usize = 128 * 1024;
/// Without a step for this long the board starts anew, disarmed, us.
const WATCHDOG_US: u32 = 50_000;
const SERVO_HZ: u32 = 50;

bind_interrupts!(struct Irqs {
    DMA1_STREAM0 => dma::InterruptHandler<DMA1_CH0>;
    DMA1_STREAM1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_STREAM2 => dma::InterruptHandler<DMA1_CH2>;
    DMA1_STREAM3 => dma::InterruptHandler<DMA1_CH3>;
    DMA1_STREAM4 => dma::InterruptHandler<DMA1_CH4>;
    DMA1_STREAM5 => dma::InterruptHandler<DMA1_CH5>;
    DMA1_STREAM6 => dma::InterruptHandler<DMA1_CH6>;
    I2C1_EV => i2c::EventInterruptHandler<I2C1>;
    I2C1_ER => i2c::ErrorInterruptHandler<I2C1>;
    USART3 => usart::InterruptHandler<USART3>;
});

/// What the other core would read; it is not started.
static SHARED: MaybeUninit<SharedData> = MaybeUninit::uninit();

/// Everything that is wired.
pub(crate) struct Board {
    pub(crate) actuators: Actuators,
    pub(crate) imu: Spi<'static, Async, spi::mode::Master>,
    pub(crate) imu_select: Output<'static>,
    pub(crate) gnss: UartRx<'static, Async>,
    pub(crate) barometer: I2c<'static, Async, i2c::Master>,
    pub(crate) log: UartTx<'static, Async>,
    pub(crate) switch: Switch,
    pub(crate) lamp: Lamp,
    pub(crate) watchdog: IndependentWatchdog<'static, embassy_stm32::peripherals::IWDG1>,
}

/// Clocks, pins and peripherals; `None` where a line's settings do not fit its clock.
pub(crate) fn start() -> Option<Board> {
    let p = embassy_stm32::init_primary(clocks(), &SHARED);
    let mut line = usart::Config::default();
    line.baudrate = 115_200;
    let gnss = UartRx::new(p.USART3, p.PD9, p.DMA1_CH3, Irqs, line).ok()?;
    line.baudrate = 921_600;
    let log = UartTx::new(p.USART1, p.PA9, p.DMA1_CH6, Irqs, line).ok()?;
    let mut bus = spi::Config::default();
    bus.frequency = Hertz::mhz(12);
    let pin = OutputType::PushPull;
    let mut rotors = SimplePwm::new(
        p.TIM1,
        Some(PwmPin::new(p.PE9, pin)),
        Some(PwmPin::new(p.PE11, pin)),
        Some(PwmPin::new(p.PE13, pin)),
        Some(PwmPin::new(p.PE14, pin)),
        Hertz::hz(DSHOT_BIT_HZ),
        CountingMode::EdgeAlignedUp,
    );
    let mut servos = SimplePwm::new(
        p.TIM3,
        Some(PwmPin::new(p.PC6, pin)),
        Some(PwmPin::new(p.PC7, pin)),
        None,
        None,
        Hertz::hz(SERVO_HZ),
        CountingMode::EdgeAlignedUp,
    );
    servos.ch1().enable();
    servos.ch2().enable();
    for channel in [Channel::Ch1, Channel::Ch2, Channel::Ch3, Channel::Ch4] {
        rotors.channel(channel).set_duty_cycle_fully_off();
    }
    Some(Board {
        actuators: Actuators { rotors, burst: p.DMA1_CH0, servos },
        imu: Spi::new(p.SPI1, p.PA5, p.PA7, p.PA6, p.DMA1_CH1, p.DMA1_CH2, Irqs, bus),
        imu_select: Output::new(p.PA4, Level::High, Speed::VeryHigh),
        gnss,
        barometer: I2c::new(
            p.I2C1,
            p.PB8,
            p.PB9,
            p.DMA1_CH4,
            p.DMA1_CH5,
            Irqs,
            i2c::Config::default(),
        ),
        log,
        switch: Switch(Input::new(p.PE2, Pull::Up)),
        lamp: Lamp(Output::new(p.PI12, Level::High, Speed::Low)),
        watchdog: IndependentWatchdog::new(p.IWDG1, WATCHDOG_US),
    })
}

/// 64 MHz of the internal oscillator to 400 MHz of the core; buses at 100 MHz.
fn clocks() -> Config {
    let mut config = Config::default();
    config.rcc.hsi = Some(rcc::HSIPrescaler::DIV1);
    config.rcc.pll1 = Some(rcc::Pll {
        source: rcc::PllSource::HSI,
        prediv: rcc::PllPreDiv::DIV4,
        mul: rcc::PllMul::MUL50,
        divp: Some(rcc::PllDiv::DIV2),
        divq: Some(rcc::PllDiv::DIV8),
        divr: None,
    });
    config.rcc.sys = rcc::Sysclk::PLL1_P;
    config.rcc.ahb_pre = rcc::AHBPrescaler::DIV2;
    config.rcc.apb1_pre = rcc::APBPrescaler::DIV2;
    config.rcc.apb2_pre = rcc::APBPrescaler::DIV2;
    config.rcc.apb3_pre = rcc::APBPrescaler::DIV2;
    config.rcc.apb4_pre = rcc::APBPrescaler::DIV2;
    config.rcc.voltage_scale = rcc::VoltageScale::Scale1;
    config.rcc.supply_config = rcc::SupplyConfig::DirectSMPS;
    config
}

/// The sector of the setup, whatever is in it.
pub(crate) fn setup() -> &'static [u8] {
    // SAFETY: this flash is there on every part of the type, nothing writes it while the program
    // runs, and bytes have no invalid values.
    unsafe { core::slice::from_raw_parts(SETUP_ADDRESS as *const u8, SETUP_LENGTH) }
}

/// A vector of the IMU in the body frame: forward, right, down.
pub(crate) fn body((x, y, z): (f32, f32, f32)) -> In<Body, f32> {
    In::new(Vector3::new(x, -y, -z))
}

/// Motor controllers and servos.
pub(crate) struct Actuators {
    rotors: SimplePwm<'static, TIM1>,
    burst: Peri<'static, DMA1_CH0>,
    servos: SimplePwm<'static, TIM3>,
}

impl Actuators {
    /// Sends one frame to each motor controller and moves the servos.
    pub(crate) async fn write(&mut self, outputs: &Outputs) {
        let period = u16::try_from(self.rotors.max_duty_cycle()).unwrap_or(u16::MAX);
        let waveform = dshot_waveform(outputs.dshot, period);
        let period_us = 1_000_000 / SERVO_HZ;
        for (channel, pulse_us) in [Channel::Ch1, Channel::Ch2].into_iter().zip(outputs.servo_us) {
            self.servos.channel(channel).set_duty_cycle_fraction(pulse_us, period_us);
        }
        let burst = self.burst.reborrow();
        self.rotors
            .waveform_up_multi_channel(burst, Irqs, Channel::Ch1, Channel::Ch4, &waveform)
            .await;
    }
}

/// The arming switch.
pub(crate) struct Switch(Input<'static>);

impl Switch {
    pub(crate) fn is_on(&self) -> bool {
        self.0.is_low()
    }
}

/// The lamp.
pub(crate) struct Lamp(Output<'static>);

impl Lamp {
    pub(crate) fn set(&mut self, is_lit: bool) {
        self.0.set_level(if is_lit { Level::Low } else { Level::High });
    }
}
