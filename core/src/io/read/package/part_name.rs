//! Names of parts.

/// The name of the part that `target` leads to from the part `source`: without a slash before it, as an archive has it. `None` if it leads out of
/// the package, or is no name.
pub(crate) fn resolve(source: &str, target: &str) -> Option<String> {
    let target = target.split(['#', '?']).next().unwrap_or_default();
    let (folder, path) = match target.strip_prefix('/') {
        Some(path) => ("", path),
        None => (source.rsplit_once('/').map_or("", |(folder, _)| folder), target),
    };
    let mut parts: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()?),
            part => parts.push(part),
        }
    }
    let name = unescaped(&parts.join("/"))?;
    (!name.is_empty() && !name.contains(['\\', '\0'])).then_some(name)
}

/// The name without escapes of the form %41. Writers hold names with spaces in an archive either way; those that read them look for both.
fn unescaped(name: &str) -> Option<String> {
    if !name.contains('%') {
        return Some(name.into());
    }
    let bytes = name.as_bytes();
    let (mut plain, mut at) = (Vec::new(), 0);
    while let Some(&byte) = bytes.get(at) {
        let digits = bytes.get(at + 1..at + 3).and_then(|digits| std::str::from_utf8(digits).ok());
        match digits.filter(|_| byte == b'%').and_then(|digits| u8::from_str_radix(digits, 16).ok()) {
            // A slash that is escaped would lead elsewhere than it says.
            Some(b'/' | b'\\') => return None,
            Some(plain_byte) => {
                plain.push(plain_byte);
                at += 3;
            }
            None => {
                plain.push(byte);
                at += 1;
            }
        }
    }
    let plain = String::from_utf8(plain).ok()?;
    (!plain.split('/').any(|part| part == "..")).then_some(plain)
}

/// The part that holds the relationships of a part; those of the package for no part.
pub(super) fn relationships_of(part: &str) -> String {
    let (folder, name) = part.rsplit_once('/').map_or(("", part), |(folder, name)| (folder, name));
    if folder.is_empty() { format!("_rels/{name}.rels") } else { format!("{folder}/_rels/{name}.rels") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_lead_from_their_part() {
        for (source, target, expected) in [
            ("", "/3D/3dmodel.model", Some("3D/3dmodel.model")),
            ("", "3D/3dmodel.model", Some("3D/3dmodel.model")),
            ("3D/3dmodel.model", "Objects/a.model", Some("3D/Objects/a.model")),
            ("3D/3dmodel.model", "../Metadata/a%20b.png", Some("Metadata/a b.png")),
            ("3D/a", "./b#fragment", Some("3D/b")),
            ("3D/a", "../../b", None),
            ("", "../b", None),
            ("", "%2e%2e/b", None),
            ("", "a%2fb", None),
            ("", "", None),
            ("", "100%", Some("100%")),
        ] {
            assert_eq!(resolve(source, target).as_deref(), expected, "{source} {target}");
        }
        assert_eq!(relationships_of(""), "_rels/.rels");
        assert_eq!(relationships_of("3D/3dmodel.model"), "3D/_rels/3dmodel.model.rels");
    }
}
