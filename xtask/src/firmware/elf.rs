//! The little of a 32-bit ELF file that sizes and the stack analysis need.

/// A section with its place in memory and its bytes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Section {
    pub(crate) name: String,
    pub(crate) address: u32,
    pub(crate) size: u32,
    pub(crate) bytes: Vec<u8>,
}

/// A symbol: a function, or a mark where instructions (`$t`) and data (`$d`) begin.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Symbol {
    pub(crate) name: String,
    pub(crate) address: u32,
    pub(crate) size: u32,
    pub(crate) is_function: bool,
}

/// An executable.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Elf {
    pub(crate) sections: Vec<Section>,
    pub(crate) symbols: Vec<Symbol>,
}

const NO_BITS: u32 = 8;
const SYMBOL_TABLE: u32 = 2;
const FUNCTION: u8 = 2;

impl Elf {
    /// # Errors
    /// One line where the bytes are no 32-bit little-endian ELF or break off.
    pub(crate) fn parse(bytes: &[u8]) -> Result<Self, String> {
        if bytes.get(..6) != Some(&[0x7F, b'E', b'L', b'F', 1, 1]) {
            return Err("no 32-bit little-endian ELF".to_owned());
        }
        Self::read(bytes).ok_or_else(|| "the ELF breaks off".to_owned())
    }

    fn read(bytes: &[u8]) -> Option<Self> {
        let table = word(bytes, 32)? as usize;
        let (entry, count, names) = (half(bytes, 46)?, half(bytes, 48)?, half(bytes, 50)?);
        let header = |i: u16, field: usize| {
            word(bytes, table + usize::from(i) * usize::from(entry) + 4 * field)
        };
        let content = |i: u16| {
            let (from, size) = (header(i, 4)? as usize, header(i, 5)? as usize);
            if header(i, 1)? == NO_BITS {
                Some(&[][..])
            } else {
                bytes.get(from..from.checked_add(size)?)
            }
        };
        let (mut sections, mut symbols) = (Vec::new(), Vec::new());
        for i in 0..count {
            let bytes = content(i)?;
            sections.push(Section {
                name: text(content(names)?, header(i, 0)?)?,
                address: header(i, 3)?,
                size: header(i, 5)?,
                bytes: bytes.to_vec(),
            });
            if header(i, 1)? == SYMBOL_TABLE {
                let strings = content(u16::try_from(header(i, 6)?).ok()?)?;
                for symbol in bytes.chunks_exact(16) {
                    symbols.push(Symbol {
                        name: text(strings, word(symbol, 0)?)?,
                        // The lowest bit says Thumb.
                        address: word(symbol, 4)? & !u32::from(symbol[12] & 0xF == FUNCTION),
                        size: word(symbol, 8)?,
                        is_function: symbol[12] & 0xF == FUNCTION,
                    });
                }
            }
        }
        Some(Self { sections, symbols })
    }

    /// Size of a section, bytes; 0 where there is none.
    pub(crate) fn size(&self, name: &str) -> u32 {
        self.sections.iter().find(|section| section.name == name).map_or(0, |section| section.size)
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?))
}

fn half(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..at.checked_add(2)?)?.try_into().ok()?))
}

fn text(strings: &[u8], at: u32) -> Option<String> {
    let from = strings.get(at as usize..)?;
    let end = from.iter().position(|byte| *byte == 0)?;
    Some(String::from_utf8_lossy(&from[..end]).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_elf_or_breaks_off_is_said() {
        assert!(Elf::parse(b"no").unwrap_err().contains("no 32-bit"));
        let mut head = [0; 52];
        head[..6].copy_from_slice(&[0x7F, b'E', b'L', b'F', 1, 1]);
        head[48] = 3;
        assert!(Elf::parse(&head).unwrap_err().contains("breaks off"));
    }
}
