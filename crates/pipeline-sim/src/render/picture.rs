//! The parts of a frame: background, table, and the things on it.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::cell::geometry::Cell;
use crate::render::ball_shadow::BallShadow;
use crate::render::bodies::Studio;
use crate::render::canvas::Canvas;
use crate::render::light_grid::Lighting;
use crate::render::renderer::Renderer;
use crate::render::scene::{Appearance, Thing};
use crate::render::shadow::{ThingShadows, lamps, table_light};
use crate::render::view::View;

/// Near and far edge of the table along x, and its half width along y, metres.
const TABLE: (f64, f64, f64) = (-0.45, 1.30, 1.15);
/// Depth of the floor below the shoulder, metres.
const FLOOR: f64 = -1.05;
/// Distance of the walls, metres.
const WALLS: f64 = 3.2;

impl Renderer {
    /// Draws the whole frame.
    pub(super) fn draw(&mut self, canvas: &mut Canvas, cell: &Cell, view: &View) {
        self.lay_light(view, cell);
        let studio = self.studio(cell, view);
        if !fills_frame(view, cell) {
            self.draw_backdrop(canvas, &studio);
        }
        self.draw_table(canvas, &studio);
        for item in self.items(cell, view) {
            self.draw_item(canvas, &studio, cell, &item);
        }
    }

    /// Computes the light on the table, with the shadows of ball and holder.
    fn lay_light(&mut self, view: &View, cell: &Cell) {
        let things = self.scene.things.iter().enumerate();
        let gone = things.filter(|(_, t)| in_the_way(t, cell));
        self.table.leave_out(gone.map(|(i, _)| i).collect());
        if view.eye().z <= cell.table {
            return;
        }
        let (total, _) = table_light(&self.scene);
        let light = (self.scene.table.albedo * total) as f32;
        let lighting = TableLight {
            light,
            things: &self.table,
            ball: BallShadow::new(&self.scene, &cell.ball, cell.holder, cell.table),
        };
        self.light
            .lay(view, &table_plane(view, cell.table), &lighting);
    }

    /// Returns the inputs of shading.
    fn studio<'a>(&'a self, cell: &Cell, view: &'a View) -> Studio<'a> {
        let (total, _) = table_light(&self.scene);
        Studio {
            view,
            scene: &self.scene,
            texture: &self.wood,
            lamps: lamps(&self.scene),
            table: cell.table,
            bounce: self.scene.table.albedo * total,
        }
    }

    /// Draws the table, seen from above, in the light last laid on it.
    fn draw_table(&self, canvas: &mut Canvas, studio: &Studio<'_>) {
        let view = studio.view;
        if view.eye().z <= studio.table {
            return;
        }
        let plane = table_plane(view, studio.table);
        let (near, far, half) = TABLE;
        let corners = [(near, -half), (far, -half), (far, half), (near, half)];
        let polygon = view.polygon(&corners.map(|(x, y)| Point3::new(x, y, studio.table)));
        let strength = self.scene.table.texture as f32;
        canvas.fill(&polygon, |y, x0, row| {
            studio.textured_row(&plane, strength, (y, x0), row);
            self.light.shine(y, x0, row);
        });
    }

    /// Returns the items over the table in the order of drawing.
    ///
    /// Flat things come first, then standing ones, far before near, and occluders last. Circles
    /// that do not overlap are in the right order when sorted by power (squared distance less
    /// squared radius): their radical axes separate them. A ball above a thing, or on its holder,
    /// overlaps it as seen from above: a level plane separates the two, and the one on the far side
    /// of it comes first.
    pub(super) fn items(&self, cell: &Cell, view: &View) -> Vec<Item> {
        /// Something that stands: its power and top, and `true` for what the ball is above.
        type Standing = (f64, f64, bool, Item);
        let (eye, ball) = (view.eye(), cell.ball.centre);
        let overlaps =
            |x: f64, y: f64, r: f64| (x - ball.x).hypot(y - ball.y) < r + cell.ball.radius;
        let power = |x: f64, y: f64, r: f64| (x - eye.x).powi(2) + (y - eye.y).powi(2) - r * r;
        let things = || self.scene.things.iter().enumerate();
        let flat = things().filter(|(_, t)| t.shape.is_flat());
        let mut items: Vec<Item> = flat.map(|(i, _)| Item::Thing(i)).collect();
        let stands = things().filter(|(_, t)| !t.shape.is_flat() && !in_the_way(t, cell));
        let mut standing: Vec<Standing> = stands
            .map(|(i, t)| {
                let (foot, top) = (t.shape.footprint(), cell.table + t.shape.height());
                let under = overlaps(t.x, t.y, foot);
                (power(t.x, t.y, foot), top, under, Item::Thing(i))
            })
            .collect();
        standing.extend(cell.holder.map(|h| {
            let (x, y) = (h.foot.x, h.foot.y);
            let under = ball.z > h.top && overlaps(x, y, h.radius);
            (power(x, y, h.radius), h.top, under, Item::Holder)
        }));
        standing.sort_by(|a, b| b.0.total_cmp(&a.0));
        // The ball comes by power, but after the things it is above (before them if seen from
        // below).
        let of_ball = power(ball.x, ball.y, cell.ball.radius);
        let by_power = standing.iter().filter(|s| s.0 >= of_ball).count();
        let from_above = |top: f64| eye.z > top;
        let over = |s: &Standing| s.2 && from_above(s.1);
        let below = |s: &Standing| s.2 && !from_above(s.1);
        let after = standing.iter().rposition(over).map_or(0, |i| i + 1);
        let before = standing.iter().position(below).unwrap_or(standing.len());
        let place = by_power.min(before).max(after);
        items.extend(standing[..place].iter().map(|s| s.3));
        items.push(Item::Ball);
        items.extend(standing[place..].iter().map(|s| s.3));
        items.extend((0..self.scene.occluders.len()).map(Item::Occluder));
        items
    }

    pub(super) fn draw_item(
        &self,
        canvas: &mut Canvas,
        studio: &Studio<'_>,
        cell: &Cell,
        item: &Item,
    ) {
        match item {
            Item::Thing(i) => studio.thing(canvas, &self.scene.things[*i]),
            Item::Ball => {
                let ball = &cell.ball;
                studio.sphere(canvas, &ball.centre, ball.radius, &studio.scene.ball);
            }
            Item::Holder => {
                if let Some(h) = cell.holder {
                    studio.cylinder(canvas, h.foot, h.radius, [cell.table, h.top], &ROD);
                }
            }
            Item::Occluder(i) => studio.occluder(canvas, &self.scene.occluders[*i]),
        }
    }

    /// Draws floor and walls.
    fn draw_backdrop(&self, canvas: &mut Canvas, studio: &Studio<'_>) {
        canvas.light.fill(0.30);
        let n = self.walls.len() / 2;
        let corner = |i: usize, z: f64| {
            let (sin, cos) = (i as f64 * std::f64::consts::TAU / n as f64).sin_cos();
            Point3::new(WALLS * cos, WALLS * sin, z)
        };
        for (i, pair) in self.walls.chunks_exact(2).enumerate() {
            for (light, low, high) in [(pair[0], FLOOR, 0.2), (pair[1], 0.2, 1.8)] {
                let ends = [(i, low), (i + 1, low), (i + 1, high), (i, high)];
                let polygon = studio.view.polygon(&ends.map(|(i, z)| corner(i, z)));
                canvas.fill(&polygon, |_, _, row| row.fill(light));
            }
        }
        let floor: Vec<Point3<f64>> = (0..n).map(|i| corner(i, FLOOR)).collect();
        let polygon = studio.view.polygon(&floor);
        let origin = Point3::new(0.0, 0.0, FLOOR);
        let plane = studio
            .view
            .plane(&origin, &(Vector3::x() * 4.0), &(Vector3::y() * 4.0));
        canvas.fill(&polygon, |y, x0, row| {
            studio.textured_row(&plane, 0.4, (y, x0), row);
            row.iter_mut().for_each(|value| *value *= 0.16);
        });
    }
}

/// The light on the table.
struct TableLight<'a> {
    /// Light where nothing hides the lamps.
    light: f32,
    things: &'a ThingShadows,
    ball: BallShadow,
}

impl Lighting for TableLight<'_> {
    #[inline(always)]
    fn shed(&self, x: &[f32], y: &[f32], light: &mut [f32], spare: &mut [f32]) {
        let (factors, spare) = spare.split_at_mut(x.len());
        self.ball.at(x, y, factors, spare);
        self.things.at(x, y, light);
        for (light, factor) in light.iter_mut().zip(factors) {
            *light *= *factor * self.light;
        }
    }
}

/// Returns `true` if a thing is left out because it overlaps the holder or a low ball.
fn in_the_way(thing: &Thing, cell: &Cell) -> bool {
    let ball = cell.ball.centre;
    let foot = thing.shape.footprint();
    let at_holder = cell.holder.is_some_and(|h| {
        (thing.x - h.foot.x).hypot(thing.y - h.foot.y) <= foot + h.radius.max(cell.ball.radius)
    });
    let in_ball = || (thing.x - ball.x).hypot(thing.y - ball.y) < foot + cell.ball.radius;
    !thing.shape.is_flat()
        && (at_holder
            || (ball.z - cell.ball.radius < cell.table + thing.shape.height() && in_ball()))
}

/// Appearance of the holder.
const ROD: Appearance = Appearance::new(0.35, 0.0, 0.3);

/// An item drawn over the table.
#[derive(Clone, Copy, Debug)]
pub(super) enum Item {
    /// The ball.
    Ball,
    /// The holder of the ball.
    Holder,
    /// A thing of the scene.
    Thing(usize),
    /// An occluder of the scene.
    Occluder(usize),
}

/// Returns the map from pixels to homogeneous coordinates on the table, metres along x and y.
fn table_plane(view: &View, table: f64) -> Matrix3<f64> {
    view.plane(&Point3::new(0.0, 0.0, table), &Vector3::x(), &Vector3::y())
}

/// Returns `true` if every ray of the frame meets the table.
fn fills_frame(view: &View, cell: &Cell) -> bool {
    let (near, far, half) = TABLE;
    if view.eye().z <= cell.table {
        return false;
    }
    let plane = table_plane(view, cell.table);
    let (w, h) = (view.width as f64, view.height as f64);
    let mut corners = [(-1.0, -1.0), (w, -1.0), (-1.0, h), (w, h)].into_iter();
    corners.all(|(x, y)| {
        let p = plane * Vector3::new(x, y, 1.0);
        let (u, v) = (p.x / p.z, p.y / p.z);
        p.z > 0.0 && u > near && u < far && v.abs() < half
    })
}
