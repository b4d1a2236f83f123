//! Text as an address or a header may hold it.

/// All but letters, digits and `-._~` by their bytes (RFC 3986, section 2).
pub(crate) fn escaped(text: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    text.bytes().map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_bytes_are_escaped() {
        assert_eq!(escaped("a b\"\r\nü.stl"), "a%20b%22%0D%0A%C3%BC.stl");
    }
}
