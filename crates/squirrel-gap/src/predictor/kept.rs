//! The last few answers of an expensive question.

use std::cell::RefCell;
use std::rc::Rc;

/// The last `N` answers by what they depend on, the newest first: by default that of the hypothesis
/// that others are compared with, and the last three.
pub(crate) struct Kept<K, V, const N: usize = 4>(RefCell<Vec<(K, Rc<V>)>>);

impl<K, V, const N: usize> Default for Kept<K, V, N> {
    fn default() -> Self {
        Self(RefCell::new(Vec::new()))
    }
}

impl<K: PartialEq, V, const N: usize> Kept<K, V, N> {
    /// The answer for a key, asked for if it is not there.
    pub(crate) fn get(&self, key: K, ask: impl FnOnce() -> V) -> Rc<V> {
        let mut kept = self.0.borrow_mut();
        let answer = match kept.iter().position(|(other, _)| *other == key) {
            Some(index) => kept.remove(index).1,
            None => Rc::new(ask()),
        };
        kept.truncate(N - 1);
        kept.insert(0, (key, Rc::clone(&answer)));
        answer
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_asked_last_is_not_asked_again() {
        let kept = Kept::<i32, i32, 2>::default();
        let asked = RefCell::new(0);
        let square = |x: i32| {
            *kept.get(x, || {
                *asked.borrow_mut() += 1;
                x * x
            })
        };
        assert_eq!([2, 3, 2, 3, 2].map(square), [4, 9, 4, 9, 4]);
        assert_eq!(*asked.borrow(), 2);
        assert_eq!([5, 2, 3].map(square), [25, 4, 9]);
        assert_eq!(*asked.borrow(), 4, "3 made room for 5");
    }
}
