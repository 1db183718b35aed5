//! The flight code at the end of a wire: a frame comes in, its output goes out.
//!
//! Records of [`squirrel_core::stack::wire`] on standard input; for each frame the output and the
//! number of encounters on standard output, behind their length. Ends with its input.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use squirrel_core::stack::wire::{RECORD_MAX, Reader, Record, Wire, Writer};
use squirrel_core::stack::{Stack, StackState};
use squirrel_m7::host::{File, exit};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    exit(false)
}

/// `None` where something that came in cannot be read, or nobody listens.
fn serve() -> Option<()> {
    let mut input = File::open(b"/dev/stdin\0")?;
    let mut output = File::create(b"/dev/stdout\0")?;
    let mut flight = None::<(Stack, StackState)>;
    let mut buffer = [0; RECORD_MAX];
    while let Some(record) = input.record(&mut buffer) {
        match Record::take(&mut Reader::new(record))? {
            Record::Setup(stack) => flight = Some((stack, StackState::default())),
            Record::Frame(frame, _) => {
                let (stack, state) = flight.as_mut()?;
                let result = stack.step(state, &frame);
                let mut reply = [0; RECORD_MAX];
                let mut writer = Writer::new(&mut reply);
                // Room for the length, which is known only afterwards.
                0u16.put(&mut writer);
                result.put(&mut writer);
                state.mission.encounters.put(&mut writer);
                let length = writer.bytes()?.len();
                let (head, _) = reply.split_first_chunk_mut::<2>()?;
                *head = u16::try_from(length - 2).ok()?.to_le_bytes();
                output.write(reply.get(..length)?).then_some(())?;
            }
        }
    }
    Some(())
}

#[entry]
fn main() -> ! {
    exit(serve().is_some())
}
