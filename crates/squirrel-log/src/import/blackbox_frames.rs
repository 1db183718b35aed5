//! Frames of a blackbox log: fields as the header says they are written, each less what was
//! predicted of the frames before.
//!
//! After Betaflight's "Blackbox Internals" and its `blackbox.c`. An intra frame (`I`) stands for
//! itself, and is all the history that the next frame has; an inter frame (`P`) needs the two
//! before. Behind damage, inter frames mean nothing until the next intra frame.

use std::collections::BTreeMap;

/// A step of time beyond which a frame is damaged, us.
const STEP_MAX_US: u32 = 10_000_000;
/// Frames between two that are logged, at most.
const SKIPPED_MAX: u32 = 4096;
const FIELDS_MAX: usize = 512;
/// Numbers that are written together, at most. (Encoding 6 has up to eight, all of them fields.)
const GROUP_MAX: usize = 4;
const KINDS: &[u8] = b"IPSGHE";

/// How one field is written in one kind of frame.
#[derive(Debug, Clone, Copy)]
struct Coding {
    predictor: u32,
    encoding: u32,
}

/// How the frames of a log are written.
#[derive(Debug)]
pub(super) struct Plan {
    /// Of the main frames.
    pub(super) names: Vec<String>,
    signed: Vec<bool>,
    intra: Vec<Coding>,
    inter: Vec<Coding>,
    /// Encodings of slow, GPS and home frames, whose numbers are not read.
    others: BTreeMap<u8, Vec<Coding>>,
    motor_0: usize,
    min_throttle: u32,
    min_motor: u32,
    vbat_reference: u32,
    /// Frames between two intra frames, and of how many how many are inter frames.
    intervals: (u32, u32, u32),
}

/// What a walk over the frames says at its end.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(super) struct Walked {
    pub(super) frames: usize,
    pub(super) bytes_lost: usize,
}

impl Plan {
    /// * `header` - lines of the header by name
    ///
    /// # Errors
    /// What is missing or contradicts itself.
    pub(super) fn new(header: &BTreeMap<String, String>) -> Result<Self, String> {
        let line = |name: &str| {
            header
                .get(name)
                .ok_or_else(|| format!("the header of the blackbox log has no `{name}`"))
        };
        let numbers = |name: &str| {
            let bad = |text: &str| format!("the header `{name}` has `{text}`, not a number");
            line(name)?
                .split(',')
                .map(|text| text.trim().parse::<u32>().map_err(|_| bad(text)))
                .collect::<Result<Vec<_>, _>>()
        };
        let coding = |predictor: &str, encoding: &str| {
            let (predictors, encodings) = (numbers(predictor)?, numbers(encoding)?);
            if predictors.len() != encodings.len() {
                return Err(format!("the headers `{predictor}` and `{encoding}` differ in length"));
            }
            let pairs = predictors.into_iter().zip(encodings);
            Ok(pairs
                .map(|(predictor, encoding)| Coding { predictor, encoding })
                .collect::<Vec<_>>())
        };
        let names: Vec<String> = line("Field I name")?.split(',').map(str::to_owned).collect();
        let signed: Vec<bool> = numbers("Field I signed")?.iter().map(|&bit| bit != 0).collect();
        let intra = coding("Field I predictor", "Field I encoding")?;
        let inter = coding("Field P predictor", "Field P encoding")?;
        if [signed.len(), intra.len(), inter.len()] != [names.len(); 3] || names.len() > FIELDS_MAX
        {
            return Err(format!(
                "the headers of `Field I` and `Field P` are no lists of {} fields",
                names.len()
            ));
        }
        if names.first().map(String::as_str) != Some("loopIteration")
            || names.get(1).map(String::as_str) != Some("time")
        {
            return Err(
                "the header `Field I name` does not begin with loopIteration,time".to_owned()
            );
        }
        let mut others = BTreeMap::new();
        for kind in ['S', 'G', 'H'] {
            let [predictor, encoding] =
                ["predictor", "encoding"].map(|what| format!("Field {kind} {what}"));
            if header.contains_key(&encoding) {
                others.insert(kind as u8, coding(&predictor, &encoding)?);
            }
        }
        let number = |name: &str| {
            let text = header.get(name).map_or("", |text| text.split(',').next().unwrap_or(""));
            text.trim().parse::<u32>().unwrap_or(0)
        };
        let (share, whole) =
            header.get("P interval").map_or((1, 1), |text| match text.split_once('/') {
                Some((share, whole)) => (share.parse().unwrap_or(1), whole.parse().unwrap_or(1)),
                None => (1, text.trim().parse().unwrap_or(1)),
            });
        let motor_0 = names.iter().position(|name| name == "motor[0]").unwrap_or(0);
        let (min_throttle, min_motor) = (number("minthrottle"), number("motorOutput"));
        let vbat_reference = number("vbatref");
        let intervals = (number("I interval").max(1), share.max(1), whole.max(1));
        Ok(Self {
            names,
            signed,
            intra,
            inter,
            others,
            motor_0,
            min_throttle,
            min_motor,
            vbat_reference,
            intervals,
        })
    }

    /// A raw number as the field means it.
    pub(super) fn number(&self, field: usize, raw: u32) -> f64 {
        if self.signed[field] { f64::from(raw.cast_signed()) } else { f64::from(raw) }
    }

    /// Decodes all main frames; `visit` gets the time, us, and the raw numbers of each.
    pub(super) fn walk(&self, data: &[u8], mut visit: impl FnMut(u64, &[u32])) -> Walked {
        // A group may end behind the last field: there is room for the numbers that belong to none.
        let fields = self.others.values().map(Vec::len).fold(self.names.len(), usize::max);
        let mut state = State::new(fields + GROUP_MAX);
        let (mut bytes, mut walked) = (Bytes { data, at: 0 }, Walked::default());
        while bytes.at < data.len() {
            let start = bytes.at;
            bytes.at += 1;
            let read = match data[start] {
                b'I' => self.main(&mut bytes, &mut state, true),
                b'P' => self.main(&mut bytes, &mut state, false),
                b'E' => event(&mut bytes),
                kind => self.others.get(&kind).and_then(|codings| {
                    codings_of(&mut bytes, codings, &mut state.current)?;
                    Some(Frame::Other)
                }),
            };
            // A frame is whole if another begins behind it.
            let whole = data.get(bytes.at).is_none_or(|next| KINDS.contains(next));
            match read.filter(|_| whole) {
                Some(Frame::Main(time_us)) => {
                    if state.accept(time_us, data[start] == b'I') {
                        walked.frames += 1;
                        visit(state.time_us, &state.last);
                    } else {
                        walked.bytes_lost += bytes.at - start;
                    }
                }
                Some(Frame::Useless) => walked.bytes_lost += bytes.at - start,
                Some(Frame::Resume) => state.leap = true,
                Some(Frame::Other) => {}
                Some(Frame::End) => break,
                None => {
                    state.valid = false;
                    let next = data[start + 1..].iter().position(|byte| KINDS.contains(byte));
                    bytes.at = next.map_or(data.len(), |at| start + 1 + at);
                    walked.bytes_lost += bytes.at - start;
                }
            }
        }
        walked
    }

    fn main(&self, bytes: &mut Bytes, state: &mut State, intra: bool) -> Option<Frame> {
        let codings = if intra { &self.intra } else { &self.inter };
        codings_of(bytes, codings, &mut state.current)?;
        if !intra && !state.valid {
            return Some(Frame::Useless);
        }
        for (i, coding) in codings.iter().enumerate() {
            let (last, before) = (state.last[i], state.before[i]);
            let base = match coding.predictor {
                0 => 0,
                1 => last,
                2 => last.wrapping_mul(2).wrapping_sub(before),
                3 if self.signed[i] => {
                    let sum = i64::from(last.cast_signed()) + i64::from(before.cast_signed());
                    (sum / 2) as u32
                }
                3 => u64::midpoint(last.into(), before.into()) as u32,
                4 => self.min_throttle,
                5 => state.current[self.motor_0],
                6 => last.wrapping_add(1 + self.skipped(last)),
                8 => 1500,
                9 => self.vbat_reference,
                11 => self.min_motor,
                _ => return None,
            };
            state.current[i] = state.current[i].wrapping_add(base);
        }
        Some(Frame::Main(state.current[1]))
    }

    /// Iterations behind one that are not logged by the header's intervals.
    fn skipped(&self, iteration: u32) -> u32 {
        let (intra, share, whole) = self.intervals;
        let logged = |i: u32| (i % intra).wrapping_add(share - 1) % whole < share;
        (0..SKIPPED_MAX).find(|k| logged(iteration.wrapping_add(1 + k))).unwrap_or(0)
    }
}

enum Frame {
    /// With the time that it says, us.
    Main(u32),
    /// An inter frame without the frames before.
    Useless,
    Other,
    /// Time may leap.
    Resume,
    End,
}

/// What the next main frame is predicted of.
struct State {
    current: Vec<u32>,
    last: Vec<u32>,
    before: Vec<u32>,
    valid: bool,
    /// Whether a leap of time is announced.
    leap: bool,
    /// Of the last frame, without the wrap of its 32 bits.
    time_us: u64,
    /// Time of an intra frame that was too far from the last to be believed.
    doubted_us: Option<u32>,
    first: bool,
}

impl State {
    fn new(fields: usize) -> Self {
        let zeros = || vec![0; fields];
        let (current, last, before) = (zeros(), zeros(), zeros());
        Self {
            current,
            last,
            before,
            valid: false,
            leap: false,
            time_us: 0,
            doubted_us: None,
            first: true,
        }
    }

    /// Takes the current frame as the last, or says that it is damaged.
    fn accept(&mut self, time_us: u32, intra: bool) -> bool {
        let step_us = time_us.wrapping_sub(self.last[1]);
        let near = |from: u32| time_us.wrapping_sub(from) <= STEP_MAX_US;
        let believed = step_us <= STEP_MAX_US
            || intra && (self.first || self.leap || self.doubted_us.is_some_and(near));
        if !believed {
            (self.valid, self.doubted_us) = (false, intra.then_some(time_us));
            return false;
        }
        let unwrapped = self.time_us + u64::from(step_us);
        self.time_us = if self.first { time_us.into() } else { unwrapped };
        (self.valid, self.first, self.doubted_us) = (true, false, None);
        if intra {
            self.leap = false;
        }
        std::mem::swap(&mut self.before, &mut self.last);
        std::mem::swap(&mut self.last, &mut self.current);
        if intra {
            // It is all the history that there is.
            self.before.copy_from_slice(&self.last);
        }
        true
    }
}

struct Bytes<'a> {
    data: &'a [u8],
    at: usize,
}

impl Bytes<'_> {
    fn byte(&mut self) -> Option<u32> {
        let byte = *self.data.get(self.at)?;
        self.at += 1;
        Some(byte.into())
    }

    /// Seven bits a byte, the lowest first.
    fn unsigned(&mut self) -> Option<u32> {
        let mut value = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 127) << shift;
            if byte < 128 {
                return Some(value as u32);
            }
        }
        None
    }

    /// The same, signs in the lowest bit.
    fn signed(&mut self) -> Option<u32> {
        self.unsigned().map(|value| (value >> 1) ^ (value & 1).wrapping_neg())
    }

    fn little_endian(&mut self, bytes: u32) -> Option<u32> {
        (0..bytes).try_fold(0, |value, i| Some(value | self.byte()? << (8 * i)))
    }
}

/// A number of so many bits, the highest of which is its sign.
fn extend(value: u32, bits: u32) -> u32 {
    let shift = 32 - bits;
    ((value << shift).cast_signed() >> shift).cast_unsigned()
}

/// Reads the fields of a frame as they are written; `values` has room for a group behind the last.
fn codings_of(bytes: &mut Bytes, codings: &[Coding], values: &mut [u32]) -> Option<()> {
    let mut i = 0;
    while i < codings.len() {
        i += match codings[i].encoding {
            0 => put(values, i, [bytes.signed()?]),
            1 => put(values, i, [bytes.unsigned()?]),
            3 => put(values, i, [extend(bytes.unsigned()? & 0x3fff, 14).wrapping_neg()]),
            6 => {
                let group = codings[i..].iter().take(8).take_while(|c| c.encoding == 6).count();
                let flags = if group == 1 { 1 } else { bytes.byte()? };
                for (k, value) in values[i..i + group].iter_mut().enumerate() {
                    *value = if flags >> k & 1 == 1 { bytes.signed()? } else { 0 };
                }
                group
            }
            7 => put(values, i, three(bytes, false)?),
            8 => put(values, i, four(bytes)?),
            9 => put(values, i, [0]),
            10 => put(values, i, three(bytes, true)?),
            _ => return None,
        };
    }
    Some(())
}

/// Writes a group of numbers from place `i` on; returns how many.
fn put<const N: usize>(values: &mut [u32], i: usize, group: [u32; N]) -> usize {
    values[i..i + N].copy_from_slice(&group);
    N
}

/// Three numbers, the widest of which chooses the width: 2, 4 or 6 bits each, or whole bytes;
/// `variable` is another choice of widths.
fn three(bytes: &mut Bytes, variable: bool) -> Option<[u32; 3]> {
    let lead = bytes.byte()?;
    let bits = |value: u32, widths: [u32; 3]| {
        let [a, b, c] = widths;
        [extend(value >> (b + c), a), extend(value >> c, b), extend(value, c)]
    };
    Some(match (lead >> 6, variable) {
        (0, _) => bits(lead, [2; 3]),
        (1, false) => bits((lead & 15) << 8 | bytes.byte()?, [4; 3]),
        (1, true) => bits((lead & 63) << 8 | bytes.byte()?, [5, 5, 4]),
        (2, false) => {
            let (a, b, c) = (lead & 63, bytes.byte()? & 63, bytes.byte()? & 63);
            [a, b, c].map(|value| extend(value, 6))
        }
        (2, true) => {
            let value = (lead & 63) << 16 | bytes.byte()? << 8 | bytes.byte()?;
            bits(value, [8, 7, 7])
        }
        _ => {
            let mut values = [0; 3];
            for (i, value) in (0..).zip(&mut values) {
                let size = (lead >> (2 * i) & 3) + 1;
                *value = extend(bytes.little_endian(size)?, 8 * size);
            }
            values
        }
    })
}

/// Four numbers of 0, 4, 8 or 16 bits, half a byte after the other.
fn four(bytes: &mut Bytes) -> Option<[u32; 4]> {
    let (lead, mut half, mut values) = (bytes.byte()?, None, [0; 4]);
    for (i, value) in (0..).zip(&mut values) {
        let halves = [0, 1, 2, 4][(lead >> (2 * i) & 3) as usize];
        for _ in 0..halves {
            let next = if let Some(low) = half.take() {
                low
            } else {
                let byte = bytes.byte()?;
                half = Some(byte & 15);
                byte >> 4
            };
            *value = *value << 4 | next;
        }
        if halves > 0 {
            *value = extend(*value, 4 * halves);
        }
    }
    Some(values)
}

/// An event: its kind and what belongs to it.
fn event(bytes: &mut Bytes) -> Option<Frame> {
    let kind = bytes.byte()?;
    match kind {
        // Sync beep, disarm, a failure of INAV's inertial unit.
        0 | 15 | 40 => {
            bytes.unsigned()?;
        }
        // Logging resumes; flight mode: the flags, and those before.
        14 | 30 => {
            bytes.unsigned()?;
            bytes.unsigned()?;
        }
        // Tuning in flight.
        10 => {
            bytes.little_endian(4)?;
            bytes.byte()?;
        }
        11 => {
            bytes.little_endian(4)?;
        }
        12 => {
            bytes.little_endian(4)?;
            bytes.little_endian(4)?;
        }
        // Adjustment in flight, of a float or not.
        13 if bytes.byte()? & 128 > 0 => {
            bytes.little_endian(4)?;
        }
        13 => {
            bytes.signed()?;
        }
        255 => {
            let text = b"End of log\0";
            return bytes.data.get(bytes.at..)?.starts_with(text).then_some(Frame::End);
        }
        _ => return None,
    }
    Some(if kind == 14 { Frame::Resume } else { Frame::Other })
}
