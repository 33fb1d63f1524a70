//! The gray-level gradient at an edge pixel.

use super::rows::UNITS;

/// The gray-level gradient at an edge pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct EdgeGradient {
    x: i16,
    y: i16,
    /// Squared length at the neighbour before, here, and at the neighbour behind, along the
    /// gradient's sector.
    squares: [i32; 3],
}

impl EdgeGradient {
    pub(super) fn new(x: i16, y: i16, squares: [i32; 3]) -> Self {
        Self { x, y, squares }
    }

    /// The gradient, from dark to bright, in the units of
    /// [`CannyConfig::low`](crate::CannyConfig::low).
    pub(crate) fn vector(&self) -> (f64, f64) {
        (
            f64::from(self.x) / f64::from(UNITS),
            f64::from(self.y) / f64::from(UNITS),
        )
    }

    /// The gradient's length, in the same units.
    #[cfg(test)]
    pub(super) fn strength(&self) -> f64 {
        f64::from(self.squares[1]).sqrt() / f64::from(UNITS)
    }

    /// From the centre of the pixel to where the gradient is steepest, pixels; each part is within
    /// half a pixel.
    ///
    /// The top of the parabola through the gradient's length here and at the two neighbours across
    /// the edge.
    pub(crate) fn offset(&self) -> (f64, f64) {
        let [before, here, behind] = self.squares.map(|square| f64::from(square).sqrt());
        let bend = 2.0 * here - before - behind;
        if bend <= 0.0 {
            return (0.0, 0.0);
        }
        let along = (0.5 * (behind - before) / bend).clamp(-0.5, 0.5);
        let (dx, dy) = self.sector();
        (along * f64::from(dx), along * f64::from(dy))
    }

    /// Squared length, in units of its own.
    #[inline]
    pub(crate) fn square(&self) -> i32 {
        self.squares[1]
    }

    /// The step from the pixel to the neighbour behind.
    fn sector(&self) -> (i8, i8) {
        let (ax, ay) = (i32::from(self.x).abs(), i32::from(self.y).abs());
        if super::rows::is_shallow(ay, ax) {
            (1, 0)
        } else if super::rows::is_shallow(ax, ay) {
            (0, 1)
        } else if (self.x ^ self.y) >= 0 {
            (1, 1)
        } else {
            (-1, 1)
        }
    }
}

/// Gradients and where they are steepest, in single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Geometry<const N: usize> {
    /// The gradient, in units of its own.
    pub(crate) x: [f32; N],
    pub(crate) y: [f32; N],
    /// The [`offset`](EdgeGradient::offset).
    pub(crate) dx: [f32; N],
    pub(crate) dy: [f32; N],
}

impl<const N: usize> Geometry<N> {
    /// That of so many gradients at once.
    #[inline(always)]
    pub(crate) fn of(gradients: [&EdgeGradient; N]) -> Self {
        let (x, y) = (
            gradients.map(|gradient| i32::from(gradient.x)),
            gradients.map(|gradient| i32::from(gradient.y)),
        );
        let lengths =
            |index: usize| gradients.map(|gradient| (gradient.squares[index] as f32).sqrt());
        let (before, here, behind) = (lengths(0), lengths(1), lengths(2));
        let (mut dx, mut dy) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            let bend = 2.0 * here[i] - before[i] - behind[i];
            let top = (0.5 * (behind[i] - before[i]) / bend).clamp(-0.5, 0.5);
            let along = if bend > 0.0 { top } else { 0.0 };
            let (ax, ay) = (x[i].abs(), y[i].abs());
            let level = super::rows::is_shallow(ay, ax);
            let upright = super::rows::is_shallow(ax, ay);
            let slanted = if (x[i] ^ y[i]) >= 0 { 1.0 } else { -1.0 };
            let aside = if upright { 0.0 } else { slanted };
            dx[i] = along * if level { 1.0 } else { aside };
            dy[i] = along * if level { 0.0 } else { 1.0 };
        }
        Self {
            x: x.map(|x| x as f32),
            y: y.map(|y| y as f32),
            dx,
            dy,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::array::uniform8;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn eight_at_once_are_where_each_is(
            vectors in uniform8((-16320i16..=16320, -16320i16..=16320)),
            around in uniform8((0.0f64..1.2, 0.0f64..1.2)),
        ) {
            let gradients: [EdgeGradient; 8] = std::array::from_fn(|i| {
                let (x, y) = vectors[i];
                let here = i32::from(x).pow(2) + i32::from(y).pow(2);
                let part = |share: f64| (f64::from(here) * share) as i32;
                EdgeGradient::new(x, y, [part(around[i].0), here, part(around[i].1)])
            });
            let geometry = Geometry::of(gradients.each_ref());
            for (i, gradient) in gradients.iter().enumerate() {
                let ((x, y), (dx, dy)) = (gradient.vector(), gradient.offset());
                let units = ((16.0 * x) as f32, (16.0 * y) as f32);
                prop_assert_eq!((geometry.x[i], geometry.y[i]), units);
                // Where the three lengths are nearly on a line single precision places the top of
                // the parabola anywhere.
                let lengths = gradient.squares.map(|square| f64::from(square).sqrt());
                let [before, here, behind] = lengths;
                if (2.0 * here - before - behind).abs() > 1e-3 * here {
                    let (x, y) = (f64::from(geometry.dx[i]), f64::from(geometry.dy[i]));
                    let off = (x - dx).abs() + (y - dy).abs();
                    prop_assert!(off < 1e-3, "{:?}: {}", gradient, off);
                }
            }
        }
    }
}
