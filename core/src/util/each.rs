//! Two, three or four values taken by a function, one after the other.
//!
//! `array::map` does the same, but its way through an iterator is not inlined into long functions (measured with Rust 1.95: a fifth of the time that
//! filling loops of curves took), and the compiler then writes each array to memory.

/// Arrays of a few values.
pub(crate) trait Each<T> {
    /// The same array of other values.
    type Of<U>;

    /// The images of all values, in their order.
    fn each<U>(self, image: impl FnMut(T) -> U) -> Self::Of<U>;
}

impl<T> Each<T> for [T; 2] {
    type Of<U> = [U; 2];

    #[inline(always)]
    fn each<U>(self, mut image: impl FnMut(T) -> U) -> [U; 2] {
        let [a, b] = self;
        [image(a), image(b)]
    }
}

impl<T> Each<T> for [T; 3] {
    type Of<U> = [U; 3];

    #[inline(always)]
    fn each<U>(self, mut image: impl FnMut(T) -> U) -> [U; 3] {
        let [a, b, c] = self;
        [image(a), image(b), image(c)]
    }
}

impl<T> Each<T> for [T; 4] {
    type Of<U> = [U; 4];

    #[inline(always)]
    fn each<U>(self, mut image: impl FnMut(T) -> U) -> [U; 4] {
        let [a, b, c, d] = self;
        [image(a), image(b), image(c), image(d)]
    }
}
