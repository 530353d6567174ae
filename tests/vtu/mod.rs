//! Reads the arrays of a .vtu file as this crate writes them: base64 behind a length in bytes.

/// The bytes of a data array of a .vtu file.
pub fn bytes(file: &str, name: &str) -> Vec<u8> {
    let tag = file.find(&format!("Name=\"{name}\"")).unwrap_or_else(|| panic!("no array {name}"));
    let start = tag + file[tag..].find('>').expect("the tag ends") + 1;
    let text = &file[start..start + file[start..].find('<').expect("the array ends")];
    let letter = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let mut out = Vec::new();
    for four in text.as_bytes().chunks(4) {
        let bits = four.iter().fold(0_u32, |bits, &c| bits << 6 | if c == b'=' { 0 } else { u32::from(letter(c)) });
        let padding = four.iter().filter(|&&c| c == b'=').count();
        out.extend_from_slice(&bits.to_be_bytes()[1..4 - padding]);
    }
    let length = u64::from_le_bytes(out[..8].try_into().expect("8 bytes"));
    assert_eq!(length as usize, out.len() - 8, "the length in front of {name}");
    out.split_off(8)
}

/// The numbers of a Float64 array.
pub fn floats(file: &str, name: &str) -> Vec<f64> {
    bytes(file, name).chunks_exact(8).map(|eight| f64::from_le_bytes(eight.try_into().expect("8 bytes"))).collect()
}
