//! Row-major rasters.

/// A raster of `width` x `height` values, row by row from the top; index = y * width + x.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane<T> {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Values, `width * height` of them.
    pub data: Vec<T>,
}

impl<T: Clone> Plane<T> {
    /// A raster filled with one value.
    pub fn filled(width: usize, height: usize, value: T) -> Plane<T> {
        Plane { width, height, data: vec![value; width * height] }
    }
}

impl<T> Plane<T> {
    /// A raster over existing values.
    ///
    /// # Panics
    /// If `data` does not hold `width * height` values.
    pub fn from_vec(width: usize, height: usize, data: Vec<T>) -> Plane<T> {
        assert_eq!(data.len(), width * height, "a {width}x{height} plane needs that many values");
        Plane { width, height, data }
    }

    /// The value at column `x`, row `y`.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> &T {
        debug_assert!(x < self.width);
        &self.data[y * self.width + x]
    }

    /// The value at column `x`, row `y`, for writing.
    #[inline]
    pub fn at_mut(&mut self, x: usize, y: usize) -> &mut T {
        debug_assert!(x < self.width);
        &mut self.data[y * self.width + x]
    }

    /// Width and height.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// A raster of the same size with each value mapped.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Plane<U> {
        Plane { width: self.width, height: self.height, data: self.data.iter().map(f).collect() }
    }
}
