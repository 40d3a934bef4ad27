//! Intermediate values of one evaluation, on the stack where they are few.

/// Values kept on the stack, and the largest size of such a value \[bytes\].
const FEW: usize = 24;
const SMALL: usize = 64;

/// Calls `then` with `count` copies of a value, to be overwritten.
#[inline]
pub fn with_copies<T: Copy, R>(value: T, count: usize, then: impl FnOnce(&mut [T]) -> R) -> R {
    if size_of::<T>() > SMALL { then(&mut vec![value; count]) } else { with_small_copies(value, count, then) }
}

/// The same for values that take little room.
#[inline]
fn with_small_copies<T: Copy, R>(value: T, count: usize, then: impl FnOnce(&mut [T]) -> R) -> R {
    let (mut few, mut many) = ([value; FEW], Vec::new());
    let values = match few.get_mut(..count) {
        Some(few) => few,
        None => {
            many.resize(count, value);
            &mut many[..]
        }
    };
    then(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_as_many_as_asked_for() {
        for count in [0, 1, FEW, FEW + 1, 1000] {
            assert!(with_copies(1.5, count, |values| values == vec![1.5; count]));
            assert!(with_copies([2.5; SMALL], count, |values| values == vec![[2.5; SMALL]; count]));
        }
    }
}
