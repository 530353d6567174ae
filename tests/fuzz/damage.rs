//! Random damage: bytes, numbers and words are replaced, pieces are cut out, doubled and moved.

/// Kind and places of one change.
pub type Change = (u8, u32, u32, u32);

/// The start and the end of word `which`.
fn word(bytes: &[u8], which: u32) -> (usize, usize) {
    let start = which as usize % (bytes.len() + 1);
    let start = (start..bytes.len()).find(|&at| !bytes[at].is_ascii_whitespace()).unwrap_or(bytes.len());
    let begin = (0..start).rev().find(|&at| bytes[at].is_ascii_whitespace()).map_or(0, |at| at + 1);
    let end = (start..bytes.len()).find(|&at| bytes[at].is_ascii_whitespace()).unwrap_or(bytes.len());
    (begin, end)
}

pub fn damage(bytes: &mut Vec<u8>, words: &[&str], (kind, a, b, c): Change) {
    let place = |x: u32| x as usize % (bytes.len() + 1);
    let text = words[c as usize % words.len()].as_bytes();
    match kind % 9 {
        0 if !bytes.is_empty() => {
            let at = a as usize % bytes.len();
            bytes[at] = c as u8;
        }
        1 => bytes.truncate(place(a)),
        2 => {
            let (start, end) = (place(a), place(a) + (b as usize % 40));
            bytes.drain(start..end.min(bytes.len()));
        }
        3 => {
            let (start, end) = (place(a), (place(a) + b as usize % 200).min(bytes.len()));
            let piece = bytes[start..end].to_vec();
            let at = place(c);
            bytes.splice(at..at, piece);
        }
        4 | 5 => {
            let (start, end) = word(bytes, a);
            bytes.splice(start..end, text.iter().copied());
        }
        6 => {
            let (from, to) = (word(bytes, a), word(bytes, b));
            let other = bytes[from.0..from.1].to_vec();
            bytes.splice(to.0..to.1, other);
        }
        7 => {
            let at = place(a);
            bytes.splice(at..at, text.iter().copied());
        }
        _ => {
            let at = place(a);
            let extreme = [0, 1, u64::MAX, 1 << 31, 1 << 62, u64::from(c), 1_000_000_000, 0x7FF0_0000_0000_0000];
            let width = if c % 2 == 0 { 4 } else { 8 };
            let value = extreme[b as usize % extreme.len()].to_le_bytes();
            let end = (at + width).min(bytes.len());
            bytes[at..end].copy_from_slice(&value[..end - at]);
        }
    }
}
