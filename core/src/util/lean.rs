//! Lists that grow by little: the largest ones are of many triangles, and twice as much room as they need is too much.

/// A list that is full grows by this share of its length.
const SHARE: usize = 8;

/// Adds an item. O(1) on average; the list has room for an eighth more than it holds, at most, and for a few.
pub(crate) fn push<T>(list: &mut Vec<T>, item: T) {
    if list.len() == list.capacity() {
        list.reserve_exact(list.len() / SHARE + SHARE);
    }
    list.push(item);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_has_little_room_to_spare() {
        let mut list = Vec::new();
        let mut moves = 0;
        for i in 0..100_000 {
            let before = list.capacity();
            push(&mut list, i);
            moves += usize::from(list.capacity() > before);
            assert!(list.capacity() <= list.len() + list.len() / SHARE + SHARE);
        }
        assert!(moves < 100, "{moves}");
    }
}
