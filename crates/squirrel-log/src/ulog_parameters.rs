//! The parameters of PX4 that a ULog file begins with.
//!
//! A header of 16 bytes, then messages of a little-endian `u16` length, a type and so many bytes;
//! `P` is a parameter: the length of its key, the key (`float NAME` or `int32_t NAME`), four bytes.
//! The definitions end where the first data do.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

const MAGIC: [u8; 7] = *b"ULog\x01\x12\x35";
const PARAMETER: u8 = b'P';
const DATA: u8 = b'D';
/// PX4 has about 1500.
const MOST_PARAMETERS: usize = 20_000;

/// The parameters by name, as they were when logging began.
///
/// # Errors
/// One line: a file that cannot be read, is no ULog file, or breaks off before the first of them.
pub fn ulog_parameters(path: &Path) -> Result<BTreeMap<String, f64>, String> {
    let at = |what: &str| format!("{}: {what}", path.display());
    let file = File::open(path).map_err(|e| at(&e.to_string()))?;
    let found = read(&mut BufReader::new(file)).map_err(|e| at(&e))?;
    if found.is_empty() {
        return Err(at("no parameters in it"));
    }
    Ok(found)
}

fn read(file: &mut impl Read) -> Result<BTreeMap<String, f64>, String> {
    let mut header = [0; 16];
    match file.read_exact(&mut header) {
        Ok(()) if header[..7] == MAGIC => {}
        Ok(()) => return Err("is no ULog file".to_owned()),
        Err(e) if e.kind() == ErrorKind::UnexpectedEof => return Err("is no ULog file".to_owned()),
        Err(e) => return Err(e.to_string()),
    }
    let mut found = BTreeMap::new();
    let mut message = Vec::new();
    loop {
        let mut head = [0; 3];
        // What is cut off has the parameters that were written.
        if file.read_exact(&mut head).is_err() || head[2] == DATA {
            return Ok(found);
        }
        let length = usize::from(u16::from_le_bytes([head[0], head[1]]));
        message.resize(length, 0);
        if file.read_exact(&mut message).is_err() {
            return Ok(found);
        }
        if head[2] != PARAMETER {
            continue;
        }
        if let Some((name, value)) = parameter(&message) {
            found.insert(name.to_owned(), value);
        }
        if found.len() > MOST_PARAMETERS {
            return Err(format!("more than {MOST_PARAMETERS} parameters"));
        }
    }
}

fn parameter(message: &[u8]) -> Option<(&str, f64)> {
    let (&length, rest) = message.split_first()?;
    let key = rest.get(..usize::from(length))?;
    let bytes: [u8; 4] = rest.get(usize::from(length)..)?.try_into().ok()?;
    let (kind, name) = std::str::from_utf8(key).ok()?.split_once(' ')?;
    match kind {
        "float" => Some((name, f64::from(f32::from_le_bytes(bytes)))),
        "int32_t" => Some((name, f64::from(i32::from_le_bytes(bytes)))),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(messages: &[(u8, Vec<u8>)]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, 0, 0, 0, 0, 0, 0, 0, 0]);
        for (kind, body) in messages {
            bytes.extend((body.len() as u16).to_le_bytes());
            bytes.push(*kind);
            bytes.extend(body);
        }
        bytes
    }

    fn message(key: &str, value: [u8; 4]) -> (u8, Vec<u8>) {
        let mut body = vec![key.len() as u8];
        body.extend(key.bytes());
        body.extend(value);
        (PARAMETER, body)
    }

    #[test]
    fn floats_and_integers_are_read_until_the_data_begin() {
        let bytes = file(&[
            message("float MPC_THR_HOVER", 0.36_f32.to_le_bytes()),
            (b'I', vec![0; 5]),
            message("int32_t CA_ROTOR_COUNT", 4_i32.to_le_bytes()),
            (DATA, vec![0; 10]),
            message("float MPC_THR_HOVER", 0.9_f32.to_le_bytes()),
        ]);
        let found = read(&mut bytes.as_slice()).unwrap();
        assert_eq!(found.len(), 2);
        assert_eq!(found["CA_ROTOR_COUNT"], 4.0);
        assert_eq!(found["MPC_THR_HOVER"], f64::from(0.36_f32));
        // Cut anywhere, what is whole is there.
        for end in 16..bytes.len() {
            assert!(read(&mut &bytes[..end]).is_ok(), "{end}");
        }
    }

    #[test]
    fn what_is_no_ulog_is_refused() {
        assert!(read(&mut b"MCAP".as_slice()).is_err());
        assert!(read(&mut [0_u8; 100].as_slice()).is_err());
        // Keys that lie about their length, kinds that are not known.
        let odd =
            file(&[(PARAMETER, vec![200, 1, 2]), (PARAMETER, vec![]), message("char X", [0; 4])]);
        assert!(read(&mut odd.as_slice()).unwrap().is_empty());
    }
}
