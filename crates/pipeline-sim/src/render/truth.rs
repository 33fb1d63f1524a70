//! What a frame really shows: every round outline, and how much of it can be seen.

use nalgebra::{Point2, Point3};
use puma_val2::Joints;

use crate::render::bodies::Studio;
use crate::render::canvas::Canvas;
use crate::render::view::View;
use crate::render::{Item, Renderer};
use crate::{Camera, Cell, Ellipse, Scene, Shape};

/// What a round outline belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Round {
    /// The ball that is to be grasped.
    Target,
    /// Another ball.
    Ball,
    /// The rim of a flat disc, or of the disc inside it.
    Disc,
    /// The upper rim of a cylinder.
    Top,
}

/// A round outline in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sighting {
    /// What it belongs to.
    pub what: Round,
    /// The exact outline ([`Ellipse::circle`] is the circle of equal mean radius), pixels.
    pub ellipse: Ellipse,
    /// Share of the outlined area that the frame shows, 0..=1: the rest is hidden behind nearer things or cut off by the frame.
    pub visible: f64,
}

/// The frame is looked at this much smaller to see what hides what.
const REDUCTION: f64 = 3.0;

impl Renderer {
    /// Every round outline that the frame of `cell` with the arm at `joints` shows, the ball's first; outlines of which nothing is
    /// visible are left out. Exact but for [`Sighting::visible`], which is good to about a hundredth.
    pub fn truth(&self, cell: &Cell, joints: &Joints) -> Vec<Sighting> {
        let pose = cell.camera_pose(joints);
        if pose.translation.vector.iter().any(|v| !v.is_finite()) {
            return Vec::new();
        }
        let view = View::new(&cell.camera, pose).reduced(REDUCTION);
        // With all lamps off, whatever is drawn is black: it hides what was white before.
        let dark = Scene {
            lights: Vec::new(),
            ambient: 0.0,
            ..self.scene.clone()
        };
        let studio = Studio {
            view: &view,
            scene: &dark,
            texture: &self.wood,
            table: cell.table,
            bounce: 0.0,
        };
        let mut canvas = Canvas::new(view.width, view.height);
        let items = self.items(cell, &view);
        let mut found = Vec::new();
        for (rank, item) in items.iter().enumerate() {
            for (what, ellipse, outline) in self.rounds(cell, &view, item) {
                canvas.light.fill(0.0);
                canvas.fill(&outline, |_, _, row| row.fill(1.0));
                for nearer in &items[rank + 1..] {
                    self.draw_item(&mut canvas, &studio, cell, nearer);
                }
                let seen: f64 = canvas.light.iter().map(|v| f64::from(*v)).sum();
                let whole = area(&outline);
                if seen > 0.0 && whole > 0.0 {
                    found.push(Sighting {
                        what,
                        ellipse,
                        visible: (seen / whole).min(1.0),
                    });
                }
            }
        }
        found.sort_by_key(|s| s.what != Round::Target);
        found
    }

    /// The round outlines of one item: the exact ellipse in the full frame, and a polygon of it in the reduced one.
    fn rounds(&self, cell: &Cell, view: &View, item: &Item) -> Vec<(Round, Ellipse, Vec<Point2<f64>>)> {
        let reduced = |points: &dyn Fn(f64) -> Option<Point2<f64>>| -> Option<Vec<Point2<f64>>> {
            (0..96)
                .map(|i| points(f64::from(i) * std::f64::consts::TAU / 96.0))
                .collect()
        };
        let sphere = |what, centre: &Point3<f64>, radius: f64| {
            let seen = view.seen(centre);
            let exact = cell.camera.project_sphere(&seen, radius).ok()?;
            let small = Camera::ideal(view.focal, view.principal, view.width as u32, view.height as u32)
                .project_sphere(&seen, radius)
                .ok()?;
            Some((what, exact, reduced(&|t| Some(small.point(t)))?))
        };
        let ring = |what, centre: Point3<f64>, radius: f64| {
            let at = |t: f64| view.seen(&(centre + nalgebra::Vector3::new(t.cos(), t.sin(), 0.0) * radius));
            let ahead = (0..96).all(|i| at(f64::from(i) * std::f64::consts::TAU / 96.0).z > 0.01);
            if !ahead || radius <= 0.0 {
                return None;
            }
            let small = Camera::ideal(view.focal, view.principal, view.width as u32, view.height as u32);
            let exact = Ellipse::of_outline(|t| cell.camera.project(&at(t)).unwrap_or_else(Point2::origin));
            Some((what, exact, reduced(&|t| small.project(&at(t)))?))
        };
        let mut found = Vec::new();
        match item {
            Item::Ball => found.extend(sphere(Round::Target, &cell.ball.centre, cell.ball.radius)),
            Item::Occluder(_) => {}
            Item::Thing(i) => {
                let thing = &self.scene.things[*i];
                let at = |z: f64| Point3::new(thing.x, thing.y, cell.table + z);
                let above = view.eye().z > cell.table + thing.shape.height();
                match thing.shape {
                    Shape::Ball { radius } => found.extend(sphere(Round::Ball, &at(radius), radius)),
                    Shape::Disc { radius, inner } if above => {
                        found.extend(ring(Round::Disc, at(0.0), radius));
                        found.extend(ring(Round::Disc, at(0.0), inner));
                    }
                    Shape::Cylinder { radius, height } if above => {
                        found.extend(ring(Round::Top, at(height), radius));
                    }
                    _ => {}
                }
            }
        }
        found
    }
}

fn area(polygon: &[Point2<f64>]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    polygon
        .iter()
        .zip(next)
        .map(|(p, q)| 0.5 * (p.x * q.y - q.x * p.y))
        .sum::<f64>()
        .abs()
}
