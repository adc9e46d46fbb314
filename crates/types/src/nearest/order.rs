//! Many questions in an order in which neighbours come together.

use super::tree::keyed;
use glam::DVec3;
use rayon::prelude::*;

/// Answers `ask` for each item, in the items' order; asked in Morton order of their positions, so that
/// neighbours find the same part of a tree in the cache.
pub fn ask_in_order<T: Sync, R: Copy + Send + Sync>(
    items: &[T],
    position: impl Fn(&T) -> DVec3 + Sync,
    ask: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    Order::of(items, position).ask(items, ask)
}

/// The Morton order of items, for those of whom more than one thing is asked.
pub struct Order {
    /// Items in their order.
    items: Vec<u32>,
    /// Place of each item in it.
    places: Vec<u32>,
}

impl Order {
    /// Of items by their positions; equal ones by index.
    ///
    /// # Panics
    /// If there are 2^32 items or more.
    pub fn of<T: Sync>(items: &[T], position: impl Fn(&T) -> DVec3 + Sync) -> Order {
        assert!(u32::try_from(items.len()).is_ok(), "{} items", items.len());
        let keyed = keyed(items.len(), &|i| [position(&items[i]).as_vec3(); 2]);
        let mut places = vec![0; items.len()];
        for (rank, k) in keyed.iter().enumerate() {
            places[k.1 as usize] = rank as u32;
        }
        Order { items: keyed.into_par_iter().map(|k| k.1).collect(), places }
    }

    /// As [`ask_in_order`], of the same items.
    ///
    /// # Panics
    /// If `items` are not as many as those that the order is of.
    pub fn ask<T: Sync, R: Copy + Send + Sync>(&self, items: &[T], ask: impl Fn(&T) -> R + Sync) -> Vec<R> {
        assert_eq!(items.len(), self.items.len(), "items of another order");
        let answers: Vec<R> =
            self.items.par_iter().with_min_len(64).map(|&i| ask(&items[i as usize])).collect();
        self.places.par_iter().map(|&rank| answers[rank as usize]).collect()
    }
}
