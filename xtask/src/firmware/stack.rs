//! The static worst case of a function's stack, from its machine code.
//!
//! Every instruction that moves the stack pointer down counts once, whether or not it is on the
//! way, and every callee on top: an upper bound. A call through a register, a frame of variable
//! size and recursion have none, and are errors.

use super::elf::Elf;
use std::collections::BTreeMap;

/// A function: what it takes itself, and whom it calls.
#[derive(Debug, Default, Clone, PartialEq)]
struct Frame {
    own_bytes: u32,
    callees: Vec<u32>,
}

/// The deepest chain of calls from a function: bytes, and the functions on it.
///
/// # Errors
/// One line where there is no bound, or no such function.
pub(crate) fn worst_case(elf: &Elf, function: &str) -> Result<(u32, Vec<String>), String> {
    let start = elf.symbols.iter().find(|s| s.is_function && plain(&s.name).ends_with(function));
    let start = start.ok_or_else(|| format!("{function}: no such function in the image"))?;
    deepest(elf, start.address, &mut Vec::new(), &mut BTreeMap::new())
}

type Known = BTreeMap<u32, (u32, Vec<String>)>;

fn deepest(
    elf: &Elf,
    address: u32,
    above: &mut Vec<u32>,
    known: &mut Known,
) -> Result<(u32, Vec<String>), String> {
    let inside = |s: &&super::elf::Symbol| {
        s.is_function
            && s.address <= address
            && (address < s.address + s.size || address == s.address)
    };
    let symbol = elf.symbols.iter().filter(inside).max_by_key(|s| s.size);
    let symbol = symbol.ok_or_else(|| format!("0x{address:x}: no function there"))?;
    if let Some(done) = known.get(&symbol.address) {
        return Ok(done.clone());
    }
    if above.contains(&symbol.address) {
        return Err(format!("{}: calls itself, its stack has no bound", plain(&symbol.name)));
    }
    let frame = frame(&code(elf, symbol.address, symbol.size))
        .map_err(|e| format!("{}: {e}", plain(&symbol.name)))?;
    above.push(symbol.address);
    let mut worst = (0, Vec::new());
    for callee in frame.callees {
        // Branches within the function are no calls.
        if !(symbol.address..symbol.address + symbol.size).contains(&callee) {
            worst = deepest(elf, callee, above, known)?.max(worst);
        }
    }
    above.pop();
    worst.0 += frame.own_bytes;
    worst.1.insert(0, plain(&symbol.name));
    known.insert(symbol.address, worst.clone());
    Ok(worst)
}

/// `a::b::c` of `_ZN1a1b1c17h0123456789abcdefE`; another name as it is.
fn plain(name: &str) -> String {
    let mut parts = Vec::new();
    let mut rest = name.strip_prefix("_ZN").unwrap_or_default();
    while let Some((length, after)) =
        rest.split_once(|c: char| !c.is_ascii_digit()).map(|(n, _)| (n, &rest[n.len()..]))
    {
        let Some(part) = length.parse().ok().and_then(|n: usize| after.get(..n)) else { break };
        parts.push(part);
        rest = &after[part.len()..];
    }
    // The last part is a hash.
    parts.pop();
    if parts.is_empty() { name.to_owned() } else { parts.join("::") }
}

/// The half-words of a function with their addresses; data between instructions is left out.
fn code(elf: &Elf, start: u32, size: u32) -> Vec<(u32, u16)> {
    let mut marks: Vec<(u32, bool)> = elf
        .symbols
        .iter()
        .filter(|s| s.name.starts_with("$t") || s.name.starts_with("$d"))
        .map(|s| (s.address, s.name.starts_with("$t")))
        .collect();
    marks.sort_unstable();
    let is_code =
        |at: u32| marks.iter().rev().find(|(mark, _)| *mark <= at).is_none_or(|(_, code)| *code);
    let mut found = Vec::new();
    for section in &elf.sections {
        for at in (start..start + size).step_by(2) {
            let offset = at.wrapping_sub(section.address) as usize;
            if let Some([low, high]) = section.bytes.get(offset..offset.saturating_add(2))
                && section.address > 0
                && is_code(at)
            {
                found.push((at, u16::from_le_bytes([*low, *high])));
            }
        }
    }
    found
}

fn frame(code: &[(u32, u16)]) -> Result<Frame, String> {
    let mut frame = Frame::default();
    let mut words = code.iter().copied();
    while let Some((at, first)) = words.next() {
        let first = u32::from(first);
        if first >> 11 < 0b11101 {
            short(&mut frame, at, first)?;
        } else if let Some((_, second)) = words.next() {
            long(&mut frame, at, first, u32::from(second))?;
        }
    }
    Ok(frame)
}

/// Instructions of 16 bits.
fn short(frame: &mut Frame, at: u32, i: u32) -> Result<(), String> {
    let to = |offset: u32| at.wrapping_add(4).wrapping_add(offset);
    match i {
        // push
        _ if i & 0xFE00 == 0xB400 => frame.own_bytes += 4 * (i & 0x1FF).count_ones(),
        // sub sp, #
        _ if i & 0xFF80 == 0xB080 => frame.own_bytes += 4 * (i & 0x7F),
        // blx register, and bx of anything but the link register
        _ if i & 0xFF87 == 0x4780 || (i & 0xFF87 == 0x4700 && i & 0x78 != 0x70) => {
            return Err(format!("0x{at:x}: a call through a register has no bound"));
        }
        // b
        _ if i & 0xF800 == 0xE000 => frame.callees.push(to(extend((i & 0x7FF) << 1, 12))),
        // b with a condition
        _ if i & 0xF000 == 0xD000 && i & 0x0E00 != 0x0E00 => {
            frame.callees.push(to(extend((i & 0xFF) << 1, 9)));
        }
        _ => {}
    }
    Ok(())
}

/// Instructions of 32 bits.
fn long(frame: &mut Frame, at: u32, i: u32, j: u32) -> Result<(), String> {
    let to = |offset: u32| at.wrapping_add(4).wrapping_add(offset);
    let immediate = (i >> 10 & 1) << 11 | (j >> 12 & 7) << 8 | j & 0xFF;
    match (i, j) {
        // push.w
        (0xE92D, _) => frame.own_bytes += 4 * j.count_ones(),
        // str register, [sp, #-n]!
        (0xF84D, _) if j & 0x0F00 == 0x0D00 => frame.own_bytes += j & 0xFF,
        // vpush
        _ if i & 0xFFBF == 0xED2D => frame.own_bytes += 4 * (j & 0xFF),
        // sub.w sp, sp, #
        _ if i & 0xFBEF == 0xF1AD && j & 0x8F00 == 0x0D00 => frame.own_bytes += expand(immediate),
        // subw sp, sp, #
        _ if i & 0xFBFF == 0xF2AD && j & 0x8F00 == 0x0D00 => frame.own_bytes += immediate,
        // sub.w sp, sp, register
        (0xEBAD, _) if j & 0x0F00 == 0x0D00 => {
            return Err(format!("0x{at:x}: a frame of variable size has no bound"));
        }
        // bl, b.w
        _ if i & 0xF800 == 0xF000 && (j & 0xD000 == 0xD000 || j & 0xD000 == 0x9000) => {
            let sign = i >> 10 & 1;
            let (a, b) = (1 ^ (j >> 13 & 1) ^ sign, 1 ^ (j >> 11 & 1) ^ sign);
            let offset = sign << 24 | a << 23 | b << 22 | (i & 0x3FF) << 12 | (j & 0x7FF) << 1;
            frame.callees.push(to(extend(offset, 25)));
        }
        // b.w with a condition
        _ if i & 0xF800 == 0xF000 && j & 0xD000 == 0x8000 && i & 0x0380 != 0x0380 => {
            let (sign, a, b) = (i >> 10 & 1, j >> 11 & 1, j >> 13 & 1);
            let offset = sign << 20 | a << 19 | b << 18 | (i & 0x3F) << 12 | (j & 0x7FF) << 1;
            frame.callees.push(to(extend(offset, 21)));
        }
        _ => {}
    }
    Ok(())
}

/// The sign of a number of `bits` bits goes into the bits above.
fn extend(number: u32, bits: u32) -> u32 {
    if number >> (bits - 1) & 1 == 1 { number | !0 << bits } else { number }
}

/// The constant that twelve bits of an instruction stand for (ThumbExpandImm).
fn expand(twelve: u32) -> u32 {
    let low = twelve & 0xFF;
    match twelve >> 8 {
        0 => low,
        1 => low << 16 | low,
        2 => low << 24 | low << 8,
        3 => low * 0x0101_0101,
        _ => (0x80 | twelve & 0x7F).rotate_right(twelve >> 7),
    }
}

#[cfg(test)]
mod tests {
    use super::super::elf::{Section, Symbol};
    use super::*;

    /// Functions of half-words, one behind the other from 0x100.
    fn image(functions: &[(&str, &[u16])]) -> Elf {
        let (mut bytes, mut symbols) = (Vec::new(), Vec::new());
        for (name, code) in functions {
            let address = 0x100 + u32::try_from(bytes.len()).unwrap();
            let size = u32::try_from(2 * code.len()).unwrap();
            symbols.push(Symbol { name: (*name).to_owned(), address, size, is_function: true });
            bytes.extend(code.iter().flat_map(|word| word.to_le_bytes()));
        }
        let size = u32::try_from(bytes.len()).unwrap();
        let text = Section { name: ".text".to_owned(), address: 0x100, size, bytes };
        Elf { sections: vec![text], symbols }
    }

    #[test]
    fn frames_add_up_along_the_deepest_call() {
        // push {r4, lr}; sub sp, #16; bl small; b.w deep
        let top = [0xB510, 0xB084, 0xF000, 0xF802, 0xF000, 0xB801];
        // bx lr
        let small = [0x4770];
        // push.w {r4-r7}; sub.w sp, sp, #1544; vpush {d8}; bx lr
        let deep = [0xE92D, 0x00F0, 0xF5AD, 0x6DC1, 0xED2D, 0x8B02, 0x4770];
        let elf = image(&[("top", &top), ("small", &small), ("deep", &deep)]);
        let chain = vec!["top".to_owned(), "deep".to_owned()];
        assert_eq!(worst_case(&elf, "top"), Ok((8 + 16 + 16 + 1544 + 8, chain)));
    }

    #[test]
    fn names_lose_their_hash() {
        assert_eq!(plain("_ZN4step13squirrel_step17h0123456789abcdefE"), "step::squirrel_step");
        assert_eq!(plain("__aeabi_memcpy"), "__aeabi_memcpy");
    }

    #[test]
    fn what_has_no_bound_is_an_error() {
        // bl itself; blx r3; sub.w sp, sp, r0
        for (code, reason) in [
            (&[0xF7FF, 0xFFFE][..], ""),
            (&[0x4798][..], "through a register"),
            (&[0xEBAD, 0x0D00][..], "variable size"),
        ] {
            let result = worst_case(&image(&[("f", code)]), "f");
            if reason.is_empty() {
                assert_eq!(result.unwrap().0, 0, "a branch within is no call");
            } else {
                assert!(result.unwrap_err().contains(reason));
            }
        }
        // a: bl b; b: bl a
        let elf = image(&[("a", &[0xF000, 0xF800]), ("b", &[0xF7FF, 0xFFFC])]);
        assert!(worst_case(&elf, "a").unwrap_err().contains("calls itself"));
        assert!(worst_case(&elf, "none").is_err());
    }
}
