//! A frame around a circle, unrolled: a column of values for each direction, a row for each
//! distance from the outline.
//!
//! All directions of a row lie together, so that the loops over them become vector code.

use super::directions::Rays;

/// A gray frame of any size of the pyramid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gray<'a> {
    pub(super) pixels: &'a [u8],
    pub(super) width: usize,
    pub(super) height: usize,
}

/// A circle in pixels of some size of the pyramid.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ring {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) r: f32,
}

impl Ring {
    /// Distance of the centres and difference of the radii.
    pub(super) fn apart(&self, other: &Self) -> f32 {
        let (dx, dy) = (self.x - other.x, self.y - other.y);
        (dx * dx + dy * dy).sqrt() + (self.r - other.r).abs()
    }

    /// The circle displaced by the centre and radius of `shift`.
    pub(super) fn moved(&self, shift: &Self) -> Self {
        Self {
            x: self.x + shift.x,
            y: self.y + shift.y,
            r: self.r + shift.r,
        }
    }

    /// The displacement of centre and radius since `start`.
    pub(super) fn since(&self, start: &Self) -> Self {
        Self {
            x: self.x - start.x,
            y: self.y - start.y,
            r: self.r - start.r,
        }
    }

    /// The circle in the frame whose width and height are divided by `factor`.
    pub(super) fn shrunk(&self, factor: f32) -> Self {
        let corner = 0.5 * (factor - 1.0);
        Self {
            x: (self.x - corner) / factor,
            y: (self.y - corner) / factor,
            r: self.r / factor,
        }
    }

    /// The circle in the frame whose width and height are multiplied by `factor`.
    pub(super) fn grown(&self, factor: f32) -> Self {
        let corner = 0.5 * (factor - 1.0);
        Self {
            x: self.x * factor + corner,
            y: self.y * factor + corner,
            r: self.r * factor,
        }
    }
}

/// Derivatives outward and along the outline, on a grid of directions and distances.
#[derive(Clone, Debug, Default)]
pub(super) struct Polar {
    /// Directions, a multiple of [`LANES`].
    pub(super) rays: usize,
    /// Distances.
    pub(super) steps: usize,
    /// Gray levels, one row more than distances; a row begins and ends with [`MARGIN`] values of
    /// the other end.
    gray: Vec<f32>,
    /// Derivative outward per pixel, averaged along the outline; `rays` values a row.
    pub(super) outward: Vec<f32>,
    /// Derivative along the outline per pixel; `rays` values a row.
    pub(super) along: Vec<f32>,
    /// 1 where the outline is inside the frame, 0 elsewhere.
    pub(super) visible: Vec<f32>,
}

/// Directions that are worked on together.
pub(super) const LANES: usize = 8;
/// Largest number of directions for which slopes are averaged across the outline.
const MOST_SOFT: usize = 64;
/// Largest number of directions averaged on either side.
const MARGIN: usize = 8;

impl Polar {
    /// Distance of a row outside the outline, pixels; fractions lie between rows.
    #[inline(always)]
    pub(super) fn distance(&self, row: f32) -> f32 {
        row - 0.5 * (self.steps - 1) as f32
    }

    /// The gray level half a pixel inside of the distance of this row; there is one row more than
    /// distances.
    #[inline(always)]
    pub(super) fn gray(&self, row: usize, ray: usize) -> f32 {
        self.gray[row.min(self.steps) * (self.rays + 2 * MARGIN) + MARGIN + ray]
    }

    /// Samples the frame along the rays, up to `reach` pixels on either side of the outline, and
    /// averages the outward slopes over `2 half + 1` neighbouring directions (`half` at most 8).
    #[inline(always)]
    pub(super) fn sample(
        &mut self,
        frame: Gray<'_>,
        rays: Rays<'_>,
        ring: &Ring,
        reach: usize,
        half: usize,
    ) {
        let Rays { x: ux, y: uy } = rays;
        let count = ux.len();
        let stride = count + 2 * MARGIN;
        self.rays = count;
        self.steps = 2 * reach + 1;
        self.gray.resize((self.steps + 1) * stride, 0.0);
        self.outward.resize(self.steps * count, 0.0);
        self.along.resize(self.steps * count, 0.0);
        self.visible.resize(count, 0.0);

        let Gray {
            pixels,
            width,
            height,
        } = frame;
        let (right, bottom) = ((width - 1) as f32, (height - 1) as f32);
        // Just inside of the last pixels, so that there is always a neighbour.
        let (most_x, most_y) = (right - 0.001, bottom - 0.001);
        let inside = |at: f32, end: f32| f32::from(u8::from(at >= 0.5 && at <= end - 0.5));
        for (visible, (&ux, &uy)) in self.visible.iter_mut().zip(ux.iter().zip(uy)) {
            *visible = inside(ring.x + ring.r * ux, right) * inside(ring.y + ring.r * uy, bottom);
        }
        for (step, row) in self.gray.chunks_exact_mut(stride).enumerate() {
            let r = ring.r - reach as f32 - 0.5 + step as f32;
            let out = &mut row[MARGIN..MARGIN + count];
            let (ux, uy) = (ux.as_chunks::<LANES>().0, uy.as_chunks::<LANES>().0);
            for ((out, ux), uy) in out.as_chunks_mut::<LANES>().0.iter_mut().zip(ux).zip(uy) {
                *out = bilinear(pixels, width, ring, r, (most_x, most_y), ux, uy);
            }
            row.copy_within(count..MARGIN + count, 0);
            row.copy_within(MARGIN..2 * MARGIN, MARGIN + count);
        }
        self.differentiate(ring.r, half.min(MARGIN));
    }

    /// Averages the outward slopes over three distances.
    #[inline(always)]
    pub(super) fn soften(&mut self) {
        let count = self.rays.min(MOST_SOFT);
        let mut before = [0.0f32; MOST_SOFT];
        before[..count].copy_from_slice(&self.outward[..count]);
        for step in 0..self.steps {
            let behind = (step + 1).min(self.steps - 1) * self.rays;
            let at = step * self.rays;
            for (ray, before) in before[..count].iter_mut().enumerate() {
                let here = self.outward[at + ray];
                self.outward[at + ray] =
                    (*before + here + self.outward[behind + ray]) * (1.0 / 3.0);
                *before = here;
            }
        }
    }

    #[inline(always)]
    fn differentiate(&mut self, r: f32, half: usize) {
        let count = self.rays;
        let stride = count + 2 * MARGIN;
        let arc = r * std::f32::consts::TAU / count as f32;
        // The slope along the outline is taken over at least two pixels.
        let lag = ((1.0 / arc.max(0.1)) as usize + 1).max(half).min(MARGIN);
        let (share, slope) = (1.0 / (2 * half + 1) as f32, 0.25 / (lag as f32 * arc));
        for step in 0..self.steps {
            let (near, far) = self.gray[step * stride..][..2 * stride].split_at(stride);
            let out = &mut self.outward[step * count..][..count];
            let first = MARGIN - half;
            let (near_by, far_by) = (&near[first..][..count], &far[first..][..count]);
            for index in 0..count {
                out[index] = (far_by[index] - near_by[index]) * share;
            }
            for shift in first + 1..=MARGIN + half {
                let (near, far) = (&near[shift..][..count], &far[shift..][..count]);
                for index in 0..count {
                    out[index] += (far[index] - near[index]) * share;
                }
            }
            let out = &mut self.along[step * count..][..count];
            let (ahead, behind) = (MARGIN + lag, MARGIN - lag);
            let (near_ahead, near_behind) = (&near[ahead..][..count], &near[behind..][..count]);
            let (far_ahead, far_behind) = (&far[ahead..][..count], &far[behind..][..count]);
            for index in 0..count {
                out[index] = slope
                    * ((near_ahead[index] + far_ahead[index])
                        - (near_behind[index] + far_behind[index]));
            }
        }
    }
}

/// The nearest whole number, twice; of two equally near ones the even one. For numbers of less than
/// 22 bits.
///
/// A cast would do, but as it saturates the compiler makes no vectors of it.
#[inline(always)]
pub(super) fn whole(x: f32) -> (i32, f32) {
    // Numbers of this size cannot hold fractions, and their last bits are whole numbers.
    const SHIFT: f32 = 12_582_912.0;
    let shifted = x + SHIFT;
    (
        shifted.to_bits() as i32 - SHIFT.to_bits() as i32,
        shifted - SHIFT,
    )
}

/// The gray levels at distance `r` from the centre of the ring in eight directions.
#[inline(always)]
fn bilinear(
    pixels: &[u8],
    width: usize,
    ring: &Ring,
    r: f32,
    (most_x, most_y): (f32, f32),
    ux: &[f32; LANES],
    uy: &[f32; LANES],
) -> [f32; LANES] {
    let (mut fx, mut fy, mut at) = ([0.0; LANES], [0.0; LANES], [0i32; LANES]);
    for lane in 0..LANES {
        let x = (ring.x + r * ux[lane]).max(0.0).min(most_x);
        let y = (ring.y + r * uy[lane]).max(0.0).min(most_y);
        let ((left, before), (top, above)) = (whole(x - 0.5), whole(y - 0.5));
        fx[lane] = x - before;
        fy[lane] = y - above;
        at[lane] = top * width as i32 + left;
    }
    // Two pixels of a row as the two bytes of a word. They are always there; one check for four
    // pixels is cheaper than a proof.
    let below = pixels.get(width..).unwrap_or_default();
    let above = &pixels[..below.len()];
    let (mut upper, mut lower) = ([0i32; LANES], [0i32; LANES]);
    for lane in 0..LANES {
        let left = at[lane] as u32 as usize;
        if left + 1 < below.len() {
            upper[lane] = i32::from(u16::from_le_bytes([above[left], above[left + 1]]));
            lower[lane] = i32::from(u16::from_le_bytes([below[left], below[left + 1]]));
        }
    }
    let (mut a, mut b, mut c, mut d) = ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        a[lane] = (upper[lane] & 0xff) as f32;
        b[lane] = (upper[lane] >> 8) as f32;
        c[lane] = (lower[lane] & 0xff) as f32;
        d[lane] = (lower[lane] >> 8) as f32;
    }
    let mut gray = [0.0; LANES];
    for lane in 0..LANES {
        let upper = a[lane] + (b[lane] - a[lane]) * fx[lane];
        let lower = c[lane] + (d[lane] - c[lane]) * fx[lane];
        gray[lane] = upper + (lower - upper) * fy[lane];
    }
    gray
}
