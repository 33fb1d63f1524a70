//! The edge points of a size that are searched: of too many the strongest of the frame, and some of
//! each tile, so that strong edges elsewhere do not crowd out weak ones.

use crate::edges::Candidate;

/// The side of a tile, pixels.
const TILE: usize = 64;
/// Pixels of the frame per edge point that is kept; of more points the strongest are kept.
const PIXELS_PER_POINT: usize = 12;
/// Number of points up to which a small frame may keep four times as many.
const FEW: usize = 1500;
/// One in so many of the points that the area of a tile allows is kept there, however weak.
const TILE_SHARE: usize = 4;

/// The strongest points of a frame and of each of its tiles.
#[derive(Clone, Debug, Default)]
pub(super) struct Thinning {
    kept: Vec<Candidate>,
    /// Squared slopes, tile by tile.
    squares: Vec<i32>,
    /// End of the squares of each tile.
    ends: Vec<u32>,
    /// The least square that is kept in each tile.
    least: Vec<i32>,
}

impl Thinning {
    /// The points, or of too many the strongest.
    pub(super) fn strongest<'a>(
        &'a mut self,
        points: &'a [Candidate],
        (width, height): (usize, usize),
    ) -> &'a [Candidate] {
        let pixels = width * height;
        let most = (pixels / PIXELS_PER_POINT).max(FEW.min(4 * pixels / PIXELS_PER_POINT));
        if points.len() <= most {
            return points;
        }
        let columns = width.div_ceil(TILE);
        let tile = |point: &Candidate| {
            point.pixel.y as usize / TILE * columns + point.pixel.x as usize / TILE
        };
        let tiles = columns * height.div_ceil(TILE);
        self.ends.clear();
        self.ends.resize(tiles + 1, 0);
        for point in points {
            self.ends[tile(point) + 1] += 1;
        }
        for index in 1..=tiles {
            self.ends[index] += self.ends[index - 1];
        }
        self.squares.resize(points.len(), 0);
        // Each tile's start moves on to its end, which is the start of the next.
        for point in points {
            let place = &mut self.ends[tile(point)];
            self.squares[*place as usize] = point.gradient.square();
            *place += 1;
        }
        self.least.clear();
        let mut start = 0;
        for (index, &end) in self.ends[..tiles].iter().enumerate() {
            let squares = &mut self.squares[start..end as usize];
            start = end as usize;
            let across = TILE.min(width - index % columns * TILE);
            let down = TILE.min(height - index / columns * TILE);
            let share = across * down / (PIXELS_PER_POINT * TILE_SHARE);
            let least = if squares.len() > share {
                let rank = (squares.len() - share).min(squares.len() - 1);
                *squares.select_nth_unstable(rank).1
            } else {
                0
            };
            self.least.push(least);
        }
        let rank = points.len() - most;
        let everywhere = *self.squares.select_nth_unstable(rank).1;
        self.kept.clear();
        let strong =
            |point: &&Candidate| point.gradient.square() >= self.least[tile(point)].min(everywhere);
        self.kept.extend(points.iter().filter(strong));
        &self.kept
    }
}
