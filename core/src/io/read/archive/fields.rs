//! Little-endian fields of a ZIP archive, wherever they lie.

/// The 16-bit field at byte `at`, if it is there.
pub(super) fn short(bytes: &[u8], at: usize) -> Option<u16> {
    let field = bytes.get(at..at.checked_add(2)?)?;
    Some(u16::from_le_bytes(field.try_into().ok()?))
}

/// The 32-bit field at byte `at`, if it is there.
pub(super) fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let field = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(field.try_into().ok()?))
}

/// The 64-bit field at byte `at`, if it is there.
pub(super) fn long(bytes: &[u8], at: usize) -> Option<u64> {
    let field = bytes.get(at..at.checked_add(8)?)?;
    Some(u64::from_le_bytes(field.try_into().ok()?))
}

/// The extra field of this id (APPNOTE 4.5.1: id, length, data).
pub(super) fn extra(mut fields: &[u8], id: u16) -> Option<&[u8]> {
    loop {
        let (found, length) = (short(fields, 0)?, usize::from(short(fields, 2)?));
        let data = fields.get(4..4 + length)?;
        if found == id {
            return Some(data);
        }
        fields = fields.get(4 + length..)?;
    }
}

/// Id of the extra field with sizes of 64 bits (APPNOTE 4.5.3).
const ZIP64: u16 = 1;

/// A 32-bit field with all bits set, which says that the value stands in the ZIP64 extra field.
const ELSEWHERE: u32 = u32::MAX;

/// The values of 32-bit fields, from the ZIP64 extra field where they stand there. `None` if one is said to stand there, and does not.
pub(super) fn widened<const N: usize>(values: [u32; N], extra_fields: &[u8]) -> Option<[u64; N]> {
    let wide = extra(extra_fields, ZIP64).unwrap_or_default();
    let mut at = 0;
    let mut widened = [0; N];
    for (slot, value) in widened.iter_mut().zip(values) {
        *slot = u64::from(value);
        if value == ELSEWHERE {
            *slot = long(wide, at)?;
            at += 8;
        }
    }
    Some(widened)
}
