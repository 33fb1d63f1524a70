//! Frames that take time, drawn in parts: what lies flat, and each thing that stands, is drawn once
//! and averaged along its own way.

use nalgebra::{Matrix3, Point2, Point3, Vector3};
use puma_val2::Joints;

use crate::cell::camera::Camera;
use crate::cell::geometry::Cell;
use crate::render::canvas::{Area, Canvas};
use crate::render::lens::soften;
use crate::render::picture::{Item, fills_frame, table_plane};
use crate::render::renderer::Renderer;
use crate::render::scene::Shape;
use crate::render::smear::{Smear, Sweep, affine, mapped};
use crate::render::view::View;

/// A cell and the joints of its arm.
pub(super) type Moment = (Cell, Joints);

/// An exposure: its middle, and for each field when the shutter opens, half way, and when it
/// closes.
#[derive(Clone, Debug)]
pub(super) struct Exposed {
    pub(super) middle: Moment,
    pub(super) fields: Vec<[Moment; 3]>,
}

/// Content that moves farther than this from where it is in the middle of the exposure is drawn
/// moment by moment, pixels.
const FARTHEST: f64 = 48.0;
/// So is content whose way is bent by more than this, pixels.
const BENT: f64 = 0.3;
/// How far away what is behind the table is taken to be, metres: floor and walls are 1.3 to 4.
const FAR: f64 = 2.0;

/// The view at three times of each field.
type Times<'a> = Vec<[(&'a Cell, View); 3]>;

/// How one part of the picture moves.
struct Way {
    sweeps: Vec<Sweep>,
    /// How far at most from where it is in the middle of the exposure, pixels.
    reach: f64,
}

impl Renderer {
    /// Draws an exposure from its middle; `false` if it must be drawn moment by moment instead:
    /// because something else than arm, ball and holder changes, or something moves far, not
    /// straight or right before the lens.
    pub(super) fn illuminate_moving(&mut self, exposed: &Exposed) -> bool {
        let (middle, _) = &exposed.middle;
        let alike = |(cell, joints): &Moment| {
            let pose = cell.camera_pose(joints);
            let numbers = pose
                .translation
                .vector
                .iter()
                .chain(pose.rotation.coords.iter());
            let holders = match (cell.holder, middle.holder) {
                (Some(a), Some(b)) => a.radius.to_bits() == b.radius.to_bits(),
                (a, b) => a.is_none() && b.is_none(),
            };
            numbers
                .chain(cell.ball.centre.iter())
                .all(|v| v.is_finite())
                && holders
                && cell.camera == middle.camera
                && cell.table.to_bits() == middle.table.to_bits()
                && cell.ball.radius.to_bits() == middle.ball.radius.to_bits()
        };
        let mut moments = exposed.fields.iter().flatten().chain([&exposed.middle]);
        moments.all(alike)
            && self.through_lens(&middle.camera, |this, canvas, camera| {
                this.draw_moving(canvas, camera, exposed)
            })
    }

    fn draw_moving(&mut self, canvas: &mut Canvas, camera: &Camera, exposed: &Exposed) -> bool {
        let (cell, joints) = &exposed.middle;
        let view = View::new(camera, cell.camera_pose(joints));
        let times: Times<'_> = exposed
            .fields
            .iter()
            .map(|field| {
                field
                    .each_ref()
                    .map(|(c, j)| (c, View::new(camera, c.camera_pose(j))))
            })
            .collect();
        let items = self.items(cell, &view);
        let Some(ways) = self.ways(&items, cell, &view, &times) else {
            return false;
        };
        // What is far away is taken to lie on a plane across the view.
        let (u, v) = (view.pose * Vector3::x(), view.pose * Vector3::y());
        let far = view.eye() + view.pose * Vector3::z() * FAR;
        let grounds = (
            way_on(&view, &times, |v| table_plane(v, cell.table)),
            way_on(&view, &times, |seen| seen.plane(&far, &u, &v)),
        );
        let (Some(ground), Some(background)) = grounds else {
            return false;
        };
        let parts = Parts {
            cell,
            view: &view,
            times: &times,
            ground,
            background,
            items: items.into_iter().zip(ways).collect(),
        };
        self.compose(canvas, &parts);
        true
    }

    /// How each item moves; `None` for those out of sight and for what hangs before the lens. No
    /// answer at all if one of them cannot be drawn from the middle of the exposure.
    fn ways(
        &self,
        items: &[Item],
        cell: &Cell,
        view: &View,
        times: &Times<'_>,
    ) -> Option<Vec<Option<Way>>> {
        let room = view.wider(FARTHEST as usize);
        items
            .iter()
            .map(|item| {
                let points = self.points(item, cell, view);
                let n = points.len() as f64;
                let middle =
                    Point3::from(points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / n);
                let around = points
                    .iter()
                    .map(|p| (p - middle).norm())
                    .fold(0.0, f64::max);
                if points.is_empty() || room.misses(&middle, around) {
                    return Some(None);
                }
                let shown = view.all(&points)?;
                let mut way = Way::still(0);
                for field in times {
                    let [opened, half, closed] = field
                        .each_ref()
                        .map(|(then, seen)| seen.all(&self.points(item, then, view)));
                    let (opened, half, closed) = (opened?, half?, closed?);
                    way.note(&shown, &opened, &half, &closed)?;
                    way.sweeps.push(Sweep {
                        opened: affine(&opened, &shown)?,
                        closed: affine(&closed, &shown)?,
                    });
                }
                Some(Some(way))
            })
            .collect()
    }

    /// Points that move with an item that stands or floats: the corners of a box, both rims of a
    /// cylinder, four points of a ball's outline.
    fn points(&self, item: &Item, cell: &Cell, view: &View) -> Vec<Point3<f64>> {
        let ball = |centre: Point3<f64>, radius: f64| {
            let (u, v) = (
                view.pose * Vector3::x() * radius,
                view.pose * Vector3::y() * radius,
            );
            vec![centre + u, centre + v, centre - u, centre - v]
        };
        let rims = |x: f64, y: f64, radius: f64, (low, high): (f64, f64)| {
            let around = (0..6).map(|k| (f64::from(k) * std::f64::consts::FRAC_PI_3).sin_cos());
            let rim = around.flat_map(|(sin, cos)| {
                [low, high].map(|z| Point3::new(x + radius * cos, y + radius * sin, z))
            });
            rim.collect::<Vec<_>>()
        };
        match item {
            Item::Ball => ball(cell.ball.centre, cell.ball.radius),
            Item::Holder => cell.holder.map_or_else(Vec::new, |h| {
                rims(h.foot.x, h.foot.y, h.radius, (cell.table, h.top))
            }),
            Item::Occluder(_) => Vec::new(),
            Item::Thing(i) => {
                let thing = &self.scene.things[*i];
                let (low, high) = (cell.table, cell.table + thing.shape.height());
                match thing.shape {
                    Shape::Ball { radius } => {
                        ball(Point3::new(thing.x, thing.y, low + radius), radius)
                    }
                    Shape::Cylinder { radius, .. } => rims(thing.x, thing.y, radius, (low, high)),
                    Shape::Box { length, width, .. } => {
                        let (sin, cos) = thing.turn.sin_cos();
                        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
                        let corner = |(a, b): (f64, f64), z: f64| {
                            let (a, b) = (0.5 * a * length, 0.5 * b * width);
                            Point3::new(thing.x + a * cos - b * sin, thing.y + a * sin + b * cos, z)
                        };
                        corners
                            .iter()
                            .flat_map(|c| [corner(*c, low), corner(*c, high)])
                            .collect()
                    }
                    Shape::Disc { .. } | Shape::Print { .. } | Shape::Tape { .. } => Vec::new(),
                }
            }
        }
    }

    /// Draws the parts one over another, each averaged along its way.
    fn compose(&mut self, canvas: &mut Canvas, parts: &Parts<'_>) {
        let Parts { cell, times, .. } = *parts;
        let ways = parts.items.iter().filter_map(|(_, way)| way.as_ref());
        let reach = ways
            .chain([&parts.ground, &parts.background])
            .map(|w| w.reach);
        let margin = reach.fold(0.0, f64::max).ceil() as usize + 3;
        let wide = parts.view.wider(margin);
        let mut cells: Vec<&Cell> = times.iter().flatten().map(|(c, _)| *c).collect();
        if cells
            .iter()
            .all(|c| c.ball == cell.ball && c.holder == cell.holder)
        {
            cells.truncate(1);
        }
        self.lay_light(&wide, cell.table, &cells);
        let mut table = Layer {
            margin,
            // Fields are woven from rows that lens and sensor have blurred already.
            blur: if times.len() > 1 {
                self.scene.sensor.blur
            } else {
                0.0
            },
            drawn: std::mem::take(&mut self.sharp),
            smear: std::mem::take(&mut self.smear),
            spare: std::mem::take(&mut self.spare),
        };
        let mut layer = std::mem::take(&mut self.layer);
        let studio = self.studio(cell, &wide);
        let (width, height) = (wide.width, wide.height);
        let filled = fills_frame(&wide, cell);
        table.drawn.resize(width, height);
        layer.clear_layer(width, height);
        if !filled {
            self.draw_backdrop(&mut table.drawn, &studio);
            table.lay(&parts.background, canvas);
            std::mem::swap(&mut table.drawn, &mut layer);
        }
        self.draw_table(&mut table.drawn, &studio);
        let flat =
            |item: &Item| matches!(item, Item::Thing(i) if self.scene.things[*i].shape.is_flat());
        for (item, _) in parts.items.iter().filter(|(item, _)| flat(item)) {
            self.draw_item(&mut table.drawn, &studio, cell, item);
        }
        table.lay(&parts.ground, canvas);
        if filled {
            std::mem::swap(&mut table.drawn, &mut layer);
        }
        let still = Way::still(times.len());
        for (item, way) in parts.items.iter().filter(|(item, _)| !flat(item)) {
            let way = match (item, way) {
                (_, Some(way)) => way,
                (Item::Occluder(_), None) => &still,
                _ => continue,
            };
            table.drawn.clear_layer(width, height);
            self.draw_item(&mut table.drawn, &studio, cell, item);
            table.lay(way, canvas);
        }
        let Layer {
            drawn,
            smear,
            spare,
            ..
        } = table;
        (self.sharp, self.layer, self.smear, self.spare) = (layer, drawn, smear, spare);
    }
}

/// Everything that a frame in motion is composed of.
struct Parts<'a> {
    cell: &'a Cell,
    view: &'a View,
    times: &'a Times<'a>,
    ground: Way,
    background: Way,
    items: Vec<(Item, Option<Way>)>,
}

/// A part as drawn, and what it takes to lay it over the frame.
struct Layer {
    margin: usize,
    blur: f64,
    drawn: Canvas,
    smear: Smear,
    spare: Vec<f32>,
}

impl Layer {
    /// Lays what has been drawn over the frame, blurred, and averaged along its way.
    fn lay(&mut self, way: &Way, canvas: &mut Canvas) {
        let size = (self.drawn.width, self.drawn.height);
        let area = if self.drawn.cover.is_empty() {
            self.drawn.whole()
        } else {
            self.drawn.touched()
        };
        if area.is_empty() {
            return;
        }
        soften(
            &mut self.drawn,
            area.grown(1, size),
            self.blur,
            &mut self.spare,
        );
        let grown = area.grown(way.reach.ceil() as usize + 3, size);
        let within = |at: usize, length: usize| at.saturating_sub(self.margin).min(length);
        let area = Area {
            left: within(grown.left, canvas.width),
            right: within(grown.right, canvas.width),
            top: within(grown.top, canvas.height),
            bottom: within(grown.bottom, canvas.height),
        };
        self.smear
            .lay(&self.drawn, &way.sweeps, self.margin, area, canvas);
    }
}

impl Way {
    /// No motion, in so many fields.
    fn still(fields: usize) -> Self {
        let (opened, closed) = (Matrix3::identity(), Matrix3::identity());
        Self {
            sweeps: vec![Sweep { opened, closed }; fields],
            reach: 0.0,
        }
    }

    /// Notes how far points move that are at `shown` in the middle of the exposure; `None` if too
    /// far, or not straight on.
    fn note(
        &mut self,
        shown: &[Point2<f64>],
        opened: &[Point2<f64>],
        half: &[Point2<f64>],
        closed: &[Point2<f64>],
    ) -> Option<()> {
        for (((p, a), b), c) in shown.iter().zip(opened).zip(half).zip(closed) {
            let bent = (b - nalgebra::center(a, c)).norm();
            let reach = (a - p).norm().max((c - p).norm());
            if !(bent <= BENT && reach <= FARTHEST) {
                return None;
            }
            self.reach = self.reach.max(reach);
        }
        Some(())
    }
}

/// The way of what lies on a plane, `plane` being the map from a view's pixels to it; `None` as for
/// [`Way::note`].
fn way_on(view: &View, times: &Times<'_>, plane: impl Fn(&View) -> Matrix3<f64>) -> Option<Way> {
    let back = plane(view).try_inverse()?;
    let (w, h) = (view.width as f64 - 1.0, view.height as f64 - 1.0);
    let frame = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h), (0.5 * w, 0.5 * h)]
        .map(|(x, y)| Point2::new(x, y));
    let mut way = Way::still(0);
    for field in times {
        let maps = field.each_ref().map(|(_, seen)| back * plane(seen));
        let [opened, half, closed] = maps.map(|map| frame.map(|p| mapped(&map, p)));
        way.note(&frame, &opened, &half, &closed)?;
        way.sweeps.push(Sweep {
            opened: maps[0],
            closed: maps[2],
        });
    }
    Some(way)
}

#[cfg(test)]
#[allow(clippy::print_stdout)] // Measured errors, shown with --nocapture.
mod tests {
    use rand::SeedableRng;
    use rand::rngs::Xoshiro256PlusPlus;

    use crate::datasets::benchmark_kind::BenchmarkKind;
    use crate::datasets::scene_kind::{SceneKind, Snapshot};
    use crate::render::renderer::Renderer;
    use crate::render::scene::{Scene, Sensor};
    use crate::render::shot::Shot;

    /// The frame as it is taken, and as it is when 48 moments of every field are drawn; without
    /// noise.
    fn both(mut scene: Scene, snapshot: &Snapshot) -> [Vec<u8>; 2] {
        scene.sensor = Sensor {
            read_noise: 0.0,
            shot_noise: 0.0,
            ..scene.sensor
        };
        let mut renderer = Renderer::new(&scene, 7);
        let quick = snapshot.take(&mut renderer).to_vec();
        let fine = Snapshot {
            shot: Shot {
                moments: 48,
                ..snapshot.shot
            },
            ..*snapshot
        };
        let exact = renderer
            .take_exactly(&fine.shot, |t| fine.moment(t))
            .to_vec();
        [quick, exact]
    }

    #[test]
    fn a_frame_drawn_in_parts_is_the_mean_of_its_moments() {
        for seed in 0..5 {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut cases = Vec::new();
            for kind in [SceneKind::Motion, SceneKind::Interlaced] {
                cases.push((
                    kind.to_string(),
                    Scene::generate(kind, &mut rng),
                    Snapshot::draw(kind, &mut rng),
                ));
            }
            let kind = BenchmarkKind::MotionBlur;
            let (scene, snapshot) = kind
                .draw((768, 576), &mut rng)
                .expect("a frame with pixels");
            cases.push((kind.to_string(), scene, snapshot));
            for (name, scene, snapshot) in cases {
                let [quick, exact] = both(scene, &snapshot);
                let mut differences: Vec<u8> = quick
                    .iter()
                    .zip(&exact)
                    .map(|(a, b)| a.abs_diff(*b))
                    .collect();
                differences.sort_unstable();
                let n = differences.len();
                let mean = differences.iter().map(|d| f64::from(*d)).sum::<f64>() / n as f64;
                let (most, worst) = (differences[n - n / 1000], differences[n - 1]);
                println!(
                    "{name} {seed}: mean {mean:.3}, all but a thousandth {most}, worst {worst}"
                );
                // Rows and columns of grain pass under the edges of what stands: there the mean of
                // a product is not the product of the means.
                assert!(
                    mean < 0.8 && most <= 30,
                    "{name} {seed}: {mean} {most} {worst}"
                );
            }
        }
    }

    #[test]
    fn what_does_not_move_evenly_is_drawn_moment_by_moment() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let scene = Scene::generate(SceneKind::Motion, &mut rng);
        let snapshot = Snapshot::draw(SceneKind::Motion, &mut rng);
        let frames = |change: &dyn Fn(f64, &mut crate::Cell)| {
            let moment = |t: f64| {
                let (mut cell, joints) = snapshot.moment(t);
                change(t / snapshot.shot.exposure, &mut cell);
                (cell, joints)
            };
            let quick = Renderer::new(&scene, 7)
                .take(&snapshot.shot, moment)
                .to_vec();
            let exact = Renderer::new(&scene, 7)
                .take_exactly(&snapshot.shot, moment)
                .to_vec();
            quick == exact
        };
        // The ball jumps, swings, grows, is not there; the table sinks; the lens zooms.
        let side = |cell: &mut crate::Cell, by: f64| cell.ball.centre.y += by;
        assert!(frames(&|t, cell| side(
            cell,
            if t > 0.6 { 0.05 } else { 0.0 }
        )));
        assert!(frames(&|t, cell| side(cell, 0.02 * (6.0 * t).sin())));
        assert!(frames(&|t, cell| cell.ball.radius *= 1.0 + 0.1 * t));
        assert!(frames(&|t, cell| if t > 0.7 {
            cell.ball.centre.x = f64::NAN;
        }));
        assert!(frames(&|t, cell| cell.table -= 0.01 * t));
        assert!(frames(&|t, cell| {
            cell.camera = cell
                .camera
                .with_focal_factor(1.0 + 0.1 * t)
                .unwrap_or(cell.camera);
        }));
        // A ball that rolls on is not among them.
        assert!(!frames(&|t, cell| side(cell, 0.002 * t)));
    }

    #[test]
    fn a_frame_does_not_depend_on_those_before_it() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        let mut scene = Scene::generate(SceneKind::Clutter, &mut rng);
        scene.sensor.read_noise = 0.0;
        scene.sensor.shot_noise = 0.0;
        let kinds = [
            SceneKind::Motion,
            SceneKind::Interlaced,
            SceneKind::Distorted,
            SceneKind::Things,
            SceneKind::Interlaced,
            SceneKind::Motion,
        ];
        let mut renderer = Renderer::new(&scene, 7);
        let untouched = renderer.clone();
        for kind in kinds {
            let snapshot = Snapshot::draw(kind, &mut rng);
            let after_others = snapshot.take(&mut renderer);
            assert!(
                after_others == snapshot.take(&mut untouched.clone()),
                "{kind}"
            );
        }
    }
}
