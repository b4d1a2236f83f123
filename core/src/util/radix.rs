//! Sorting of many small items by a number, by passes over its digits instead of comparisons.

/// Fewer items are sorted by comparison.
const FEW: usize = 2048;

/// Most bits of a digit: a pass writes to so many places at once as stay in the cache.
const DIGIT: u32 = 12;

/// Sorts stably by `number`. O(items · digits of the largest number), with a copy of the items.
pub(crate) fn sort_by_number<T: Copy>(items: &mut Vec<T>, number: impl Fn(&T) -> u32) {
    if items.len() < FEW {
        items.sort_by_key(number);
        return;
    }
    let bits = u32::BITS - items.iter().map(&number).fold(0, |all, n| all | n).leading_zeros();
    let passes = bits.div_ceil(DIGIT);
    let width = bits.div_ceil(passes.max(1));
    let mut copy = items.clone();
    for pass in 0..passes {
        let digit = |item: &T| (number(item) >> (pass * width)) as usize & ((1 << width) - 1);
        let mut places = vec![0usize; 1 << width];
        items.iter().for_each(|item| places[digit(item)] += 1);
        let mut before = 0;
        for place in &mut places {
            before += std::mem::replace(place, before);
        }
        for item in items.iter() {
            let place = &mut places[digit(item)];
            copy[*place] = *item;
            *place += 1;
        }
        std::mem::swap(items, &mut copy);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// As the library's stable sort, for few and many items, small and large numbers.
        #[test]
        fn sorts_as_comparing_does(mut items in prop::collection::vec(any::<u32>(), 0..40), copies in 1usize..200, shift in 0u32..32) {
            items = items.repeat(copies).into_iter().map(|n| n >> shift).collect();
            let mut numbered: Vec<(u32, u32)> = items.into_iter().zip(0..).collect();
            let mut want = numbered.clone();
            want.sort();
            sort_by_number(&mut numbered, |item| item.0);
            prop_assert_eq!(numbered, want);
        }
    }
}
