//! The truth of a frame: every round outline and its visible fraction.

use std::f64::consts::TAU;

use nalgebra::{Point2, Point3, Vector3};
use puma_val2::Joints;

use crate::cell::camera::unit_outline;
use crate::cell::ellipse::ProjectedEllipse;
use crate::cell::geometry::Cell;
use crate::render::bodies::Studio;
use crate::render::canvas::Canvas;
use crate::render::picture::Item;
use crate::render::renderer::Renderer;
use crate::render::scene::{Scene, Shape};
use crate::render::shadow::lamps;
use crate::render::view::View;

/// The kind of body that a round outline belongs to.
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
pub struct RoundOutline {
    /// Kind of body.
    pub what: Round,
    /// Exact outline ([`ProjectedEllipse::circle`] is the circle of equal mean radius), pixels.
    pub ellipse: ProjectedEllipse,
    /// Fraction of the outlined area that the frame shows, 0..=1. The rest is hidden behind nearer
    /// things or outside the frame.
    pub visible: f64,
}

/// Pixels along the longer side of the close-up in which hidden parts of an outline are counted.
const CLOSE_UP: f64 = 96.0;

/// Number of points of an outline.
const OUTLINE: i32 = 96;

/// A round outline's kind, its exact ellipse in the frame, and its points as directions (x, y, 1)
/// of the camera frame.
type Outline = (Round, ProjectedEllipse, Vec<Point2<f64>>);

impl Renderer {
    /// Returns every round outline that the frame of `cell` with the arm at `joints` shows, the
    /// ball's first. Outlines without a visible part, or beyond the fold of the lens, are left out.
    /// All is exact but [`RoundOutline::visible`], which is accurate to about 0.01.
    pub fn truth(&self, cell: &Cell, joints: &Joints) -> Vec<RoundOutline> {
        let pose = cell.camera_pose(joints);
        if pose.translation.vector.iter().any(|v| !v.is_finite()) {
            return Vec::new();
        }
        let view = View::new(&cell.camera, pose);
        // With all lamps off, nearer things are black and hide the white outline.
        let dark = Scene {
            lights: Vec::new(),
            ambient: 0.0,
            ..self.scene.clone()
        };
        let items = self.items(cell, &view);
        let mut found = Vec::new();
        for (rank, item) in items.iter().enumerate() {
            for (what, ellipse, points) in self.rounds(cell, &view, item) {
                let visible = self.visible(cell, &view, &dark, &points, &items[rank + 1..]);
                if visible > 0.0 {
                    found.push(RoundOutline {
                        what,
                        ellipse,
                        visible,
                    });
                }
            }
        }
        found.sort_by_key(|s| s.what != Round::Target);
        found
    }

    /// Returns the fraction of the outlined area that is inside the frame and not hidden by the
    /// `nearer` things.
    fn visible(
        &self,
        cell: &Cell,
        view: &View,
        dark: &Scene,
        outline: &[Point2<f64>],
        nearer: &[Item],
    ) -> f64 {
        let spots: Vec<Point2<f64>> = outline.iter().map(|p| view.spot(p)).collect();
        let mut least = spots.iter().fold(spots[0], |a, b| a.inf(b));
        let mut most = spots.iter().fold(spots[0], |a, b| a.sup(b));
        let border = Point2::new(view.width as f64 - 0.5, view.height as f64 - 0.5);
        // Without distortion, the close-up is limited to the frame.
        let straight = cell.camera.distortion().is_none();
        if straight {
            least = least.sup(&Point2::new(-0.5, -0.5));
            most = most.inf(&border);
        }
        let extent = most - least;
        let longest = extent.x.max(extent.y);
        if !(extent.x > 0.0 && extent.y > 0.0 && longest.is_finite()) {
            return 0.0;
        }
        let scale = CLOSE_UP / longest;
        let pixels = |extent: f64| ((extent * scale).ceil() as usize).max(1);
        let size = (pixels(extent.x), pixels(extent.y));
        let close = view.part(least.coords, scale, size);
        let studio = Studio {
            view: &close,
            scene: dark,
            texture: &self.wood,
            lamps: lamps(dark),
            table: cell.table,
            bounce: 0.0,
        };
        let mut canvas = Canvas::new(size.0, size.1);
        let polygon: Vec<Point2<f64>> = outline.iter().map(|p| close.spot(p)).collect();
        canvas.fill(&polygon, |_, _, row| row.fill(1.0));
        for item in nearer {
            self.draw_item(&mut canvas, &studio, cell, item);
        }
        // Pixels on the border of the frame count by their part inside; with distortion the border
        // is bent.
        let worth = |k: usize| {
            let (x, y) = ((k % size.0) as f64, (k / size.0) as f64);
            if straight {
                (extent.x * scale - x).min(1.0) * (extent.y * scale - y).min(1.0)
            } else {
                let shown = cell.camera.project(&Point3::from(close.direction(x, y)));
                let inside = |p: Point2<f64>| {
                    p.x >= -0.5 && p.x <= border.x && p.y >= -0.5 && p.y <= border.y
                };
                f64::from(u8::from(shown.is_some_and(inside)))
            }
        };
        let light = canvas.light.iter().enumerate();
        let seen: f64 = light.map(|(k, v)| f64::from(*v) * worth(k)).sum();
        (seen / area(&polygon)).min(1.0)
    }

    /// Returns the round outlines of one item.
    fn rounds(&self, cell: &Cell, view: &View, item: &Item) -> Vec<Outline> {
        let angles = || (0..OUTLINE).map(|i| f64::from(i) * TAU / f64::from(OUTLINE));
        let sphere = |what, centre: &Point3<f64>, radius: f64| {
            let seen = view.seen(centre);
            let directions = unit_outline(&seen, radius).ok()?;
            let ellipse = cell.camera.project_sphere(&seen, radius).ok()?;
            Some((
                what,
                ellipse,
                angles().map(|t| directions.point(t)).collect(),
            ))
        };
        let ring = |what, centre: Point3<f64>, radius: f64| {
            let at = |t: f64| view.seen(&(centre + Vector3::new(t.cos(), t.sin(), 0.0) * radius));
            if !(radius > 0.0 && angles().all(|t| at(t).z > 0.01)) {
                return None;
            }
            let ellipse = ProjectedEllipse::of_outline(|t| cell.camera.project(&at(t)))?;
            let points = angles().map(|t| Point2::from(at(t).xy() / at(t).z));
            Some((what, ellipse, points.collect()))
        };
        let Item::Thing(i) = item else {
            let ball = &cell.ball;
            let target = matches!(item, Item::Ball);
            let outline = target.then(|| sphere(Round::Target, &ball.centre, ball.radius));
            return outline.flatten().into_iter().collect();
        };
        let thing = &self.scene.things[*i];
        let at = |z: f64| Point3::new(thing.x, thing.y, cell.table + z);
        let above = view.eye().z > cell.table + thing.shape.height();
        let found = match thing.shape {
            Shape::Ball { radius } => vec![sphere(Round::Ball, &at(radius), radius)],
            Shape::Disc { radius, inner } if above => vec![
                ring(Round::Disc, at(0.0), radius),
                ring(Round::Disc, at(0.0), inner),
            ],
            Shape::Cylinder { radius, height } if above => {
                vec![ring(Round::Top, at(height), radius)]
            }
            _ => Vec::new(),
        };
        found.into_iter().flatten().collect()
    }
}

fn area(polygon: &[Point2<f64>]) -> f64 {
    let pairs = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let parts = pairs.map(|(p, q)| 0.5 * (p.x * q.y - q.x * p.y));
    parts.sum::<f64>().abs()
}
