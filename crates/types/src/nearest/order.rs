//! Many questions in an order in which neighbours come together.

use super::tree::keyed;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Deref;

/// Items with a place each, and the Morton order of these places: asked in it, neighbours find the same part of a tree in the
/// cache.
pub struct Ordered<T> {
    items: Vec<T>,
    /// Indices of the items in Morton order.
    order: Vec<u32>,
    /// Place of each item in `order`.
    places: Vec<u32>,
}

impl<T: Sync> Ordered<T> {
    /// Items, in their own order, that lie where `position` says; items at one place are asked by index.
    ///
    /// # Panics
    /// If there are 2^32 items or more.
    pub fn new(items: Vec<T>, position: impl Fn(&T) -> DVec3 + Sync) -> Ordered<T> {
        assert!(u32::try_from(items.len()).is_ok(), "{} items", items.len());
        let keyed = keyed(items.len(), &|i| [position(&items[i]).as_vec3(); 2]);
        let mut places = vec![0; items.len()];
        for (rank, k) in keyed.iter().enumerate() {
            places[k.1 as usize] = rank as u32;
        }
        Ordered { items, order: keyed.into_par_iter().map(|k| k.1).collect(), places }
    }

    /// Answers for each item, in the items' own order; `ask` gets its index and the item.
    pub fn ask<R: Copy + Send + Sync>(&self, ask: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
        let one = |&i: &u32| ask(i as usize, &self.items[i as usize]);
        let answers: Vec<R> = self.order.par_iter().with_min_len(64).map(one).collect();
        self.places.par_iter().map(|&rank| answers[rank as usize]).collect()
    }

    /// The answers in place of the items, which lie where these did.
    pub fn map<R: Copy + Send + Sync>(self, ask: impl Fn(&T) -> R + Sync) -> Ordered<R> {
        Ordered { items: self.ask(|_, item| ask(item)), order: self.order, places: self.places }
    }
}

impl<T> Deref for Ordered<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.items
    }
}
