//! The cell as a drawing.

use std::fmt::Write as _;

use nalgebra::{Isometry3, Point3, Vector3};
use puma_val2::Joints;

use crate::cell::geometry::Cell;
use crate::cell::workspace::Workspace;
use crate::error::QuantityError;
use crate::error::{ascending, at_most, finite};

/// Width of the drawing, pixels.
const WIDTH: f64 = 1120.0;
/// Around what each view shows, pixels.
const MARGIN: f64 = 24.0;
/// Height of the name and the scale bar below each view, pixels.
const CAPTION: f64 = 40.0;
/// Height of the legend below both views, pixels.
const LEGEND: f64 = 34.0;
/// How far lines of sight are drawn that do not meet the table, metres: out of the picture.
const FAR: f64 = 5.0;
/// Farthest that anything drawn may be from the shoulder, metres.
const FARTHEST: f64 = 100.0;
/// Length of the scale bars, metres.
const BAR: f64 = 0.2;
/// What is drawn: class, whether as an area, and its name.
const PARTS: [(&str, bool, &str); 8] = [
    ("arm", false, "arm"),
    ("hand", false, "hand"),
    ("camera", true, "camera"),
    ("cone", true, "field of view"),
    ("space", true, "workspace"),
    ("ball", true, "ball"),
    ("path", false, "way of the tool point"),
    ("table", false, "table"),
];

/// World to page.
type Placement = Box<dyn Fn(&Point3<f64>) -> (f64, f64)>;

/// One of the two views: a projection of the world onto the page.
struct Page<'a> {
    text: &'a mut String,
    place: Placement,
    /// Pixels per metre.
    scale: f64,
}

/// The rectangle around places in the directions right and down of a view, metres.
struct Extent {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

impl Extent {
    fn of(places: impl Iterator<Item = (f64, f64)>) -> Self {
        let start = [(f64::INFINITY, f64::NEG_INFINITY); 2];
        let [(left, right), (top, bottom)] = places
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .fold(start, |[h, v], (x, y)| {
                [(h.0.min(x), h.1.max(x)), (v.0.min(y), v.1.max(y))]
            });
        // Nothing, or a point, is given some room.
        let sized = |low: f64, high: f64| (high - low).max(0.1);
        if left > right {
            return Self {
                left: 0.0,
                top: 0.0,
                width: 1.0,
                height: 1.0,
            };
        }
        Self {
            left,
            top,
            width: sized(left, right),
            height: sized(top, bottom),
        }
    }
}

impl Page<'_> {
    fn line(&mut self, points: &[Point3<f64>], class: &str) {
        let points: Vec<(f64, f64)> = points.iter().map(|p| (self.place)(p)).collect();
        self.stroke(&points, class);
    }

    /// A line through places of the page.
    fn stroke(&mut self, points: &[(f64, f64)], class: &str) {
        let points: Vec<String> = points
            .iter()
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        let _ = writeln!(
            self.text,
            r#"<polyline class="{class}" points="{}"/>"#,
            points.join(" ")
        );
    }

    fn dot(&mut self, at: &Point3<f64>, radius: f64, class: &str) {
        let (x, y) = (self.place)(at);
        let _ = writeln!(
            self.text,
            r#"<circle class="{class}" cx="{x:.1}" cy="{y:.1}" r="{:.1}"/>"#,
            radius * self.scale
        );
    }

    fn label(&mut self, x: f64, y: f64, words: &str) {
        let _ = writeln!(self.text, r#"<text x="{x:.0}" y="{y:.0}">{words}</text>"#);
    }
}

/// Names what is drawn, below both views.
fn legend(text: &mut String, top: f64) {
    let y = top + 0.5 * LEGEND;
    let mut x = 16.0;
    let drawn = PARTS.map(|(class, ..)| text.contains(&format!("class=\"{class}\"")));
    for ((class, is_area, name), _) in PARTS.into_iter().zip(drawn).filter(|(_, drawn)| *drawn) {
        let _ = if is_area {
            writeln!(
                text,
                r#"<circle class="{class}" cx="{:.0}" cy="{y:.0}" r="6"/>"#,
                x + 12.0
            )
        } else {
            writeln!(
                text,
                r#"<polyline class="{class}" points="{x:.0},{y:.0} {:.0},{y:.0}"/>"#,
                x + 24.0
            )
        };
        let _ = writeln!(
            text,
            r#"<text x="{:.0}" y="{:.0}">{name}</text>"#,
            x + 31.0,
            y + 4.0
        );
        x += 56.0 + 7.0 * name.len() as f64;
    }
}

impl Cell {
    /// As [`Cell::overview_svg`].
    ///
    /// # Errors
    /// What is to be drawn and not finite, farther than 100 m away, or the wrong way round.
    pub fn try_overview_svg(
        &self,
        workspace: &Workspace,
        path: &[Joints],
    ) -> Result<String, QuantityError> {
        let holder = self.holder.map(|h| [h.foot.x, h.foot.y, h.top]);
        let ball = self.ball.centre;
        let drawn = [
            ("the table's height (m)", vec![self.table]),
            ("the ball's place (m)", vec![ball.x, ball.y, ball.z]),
            ("the ball's radius (m)", vec![self.ball.radius]),
            (
                "the holder's place (m)",
                holder.into_iter().flatten().collect(),
            ),
        ];
        let ranges = [
            ("the workspace's distance (m)", workspace.rho),
            ("the workspace's azimuth (rad)", workspace.azimuth),
            ("the workspace's height (m)", workspace.height),
        ];
        for (quantity, range) in ranges {
            ascending(quantity, range)?;
            at_most(quantity, range.0.abs().max(range.1.abs()), FARTHEST)?;
        }
        for (quantity, values) in drawn {
            for value in values {
                finite(quantity, value)?;
                at_most(quantity, value.abs(), FARTHEST)?;
            }
        }
        Ok(self.overview_svg(workspace, path))
    }

    /// Draws the cell as SVG: the arm from the side (in its own vertical plane) and from above, the
    /// camera's field of view, the workspace, the ball, and the way of the tool point through
    /// `path`, whose last pose is the one drawn; with scale bars and a legend.
    ///
    /// An empty path, or one with angles that are not finite, gives a drawing without the arm. What
    /// lies at places that are not finite spoils the drawing; [`Cell::try_overview_svg`] refuses
    /// it.
    pub fn overview_svg(&self, workspace: &Workspace, path: &[Joints]) -> String {
        let pose = path.last().filter(|joints| joints.non_finite().is_none());
        let pan = pose.map_or(0.0, |joints| joints.0[0]);
        let shown = Shown {
            from_side: self.workspace_side(workspace, pan),
            from_above: workspace_ring(workspace),
            way: self.way(path),
            skeleton: pose.map(|joints| self.skeleton(joints)),
            sight: pose.map(|joints| self.sight_lines(joints)),
            pan,
        };
        // From the side: along the arm's own plane, so that its links show at full length.
        let side = move |p: &Point3<f64>| (p.x * pan.cos() + p.y * pan.sin(), -p.z);
        // From above: x up, y to the left.
        let above = |p: &Point3<f64>| (-p.y, -p.x);
        let foot = Point3::new(0.0, 0.0, self.table);
        let places = || shown.places().chain([self.ball.centre]);
        let extents = [
            Extent::of(
                places()
                    .chain(shown.from_side)
                    .chain([foot])
                    .map(|p| side(&p)),
            ),
            Extent::of(places().chain(shown.from_above.clone()).map(|p| above(&p))),
        ];
        // Both views to the same scale, side by side in the width.
        let scale = (WIDTH - 4.0 * MARGIN) / (extents[0].width + extents[1].width);
        let inner = scale * extents[0].height.max(extents[1].height);
        let (view, height) = (
            inner + 2.0 * MARGIN,
            inner + 2.0 * MARGIN + CAPTION + LEGEND,
        );
        let mut text = format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height:.0}" viewBox="0 0 {WIDTH} {height:.0}">
<style>
rect{{fill:#fff}} text{{font:13px sans-serif;fill:#333}} polyline{{fill:none;stroke-linejoin:round;stroke-linecap:round}}
.arm{{stroke:#3b5b7a;stroke-width:9}} .hand{{stroke:#7a8ea3;stroke-width:5}} .bracket{{stroke:#222;stroke-width:2}} .joint{{fill:#20364a}} .space{{fill:#e8f1e4;stroke:#8fb27c;stroke-width:1}}
.cone{{fill:#f4c430;fill-opacity:.25;stroke:#c99a00;stroke-width:1}} .edge{{stroke:#c99a00;stroke-width:.7}} .ball{{fill:#d8453b}} .holder{{stroke:#777;stroke-width:4}}
.table{{stroke:#8a6f4d;stroke-width:3}} .path{{stroke:#d8453b;stroke-width:1.5;stroke-dasharray:4 3}} .camera{{fill:#222}} .bar{{stroke:#333;stroke-width:1.5}}
</style>
<rect width="{WIDTH}" height="{height:.0}"/>
"##
        );
        let views: [(&str, Placement); 2] = [
            ("from the side, in the plane of the arm", Box::new(side)),
            ("from above", Box::new(above)),
        ];
        let mut left = 0.0;
        for (k, ((name, flat), extent)) in views.into_iter().zip(&extents).enumerate() {
            let width = scale * extent.width + 2.0 * MARGIN;
            // What is lower than the view is high stands in its middle.
            let (x0, y0) = (
                left + MARGIN - scale * extent.left,
                MARGIN + 0.5 * (inner - scale * extent.height) - scale * extent.top,
            );
            // Lines of sight may leave the view.
            let _ = writeln!(
                text,
                r##"<clipPath id="view{k}"><rect x="{left:.1}" width="{width:.1}" height="{view:.1}"/></clipPath>
<g clip-path="url(#view{k})">"##
            );
            let mut page = Page {
                text: &mut text,
                place: Box::new(move |p| {
                    let (x, y) = flat(p);
                    (x0 + scale * x, y0 + scale * y)
                }),
                scale,
            };
            self.draw_view(&mut page, k == 0, &shown);
            page.text.push_str("</g>\n");
            let bottom = view + CAPTION;
            page.label(left + 16.0, bottom - 14.0, name);
            let (end, y) = (left + width - 24.0, bottom - 18.0);
            let bar = [
                (end - BAR * scale, y - 4.0),
                (end - BAR * scale, y),
                (end, y),
                (end, y - 4.0),
            ];
            page.stroke(&bar, "bar");
            page.label(end - 0.5 * BAR * scale - 16.0, y - 5.0, &format!("{BAR} m"));
            left += width;
        }
        legend(&mut text, view + CAPTION);
        text.push_str("</svg>\n");
        text
    }

    fn draw_view(&self, page: &mut Page<'_>, from_side: bool, shown: &Shown) {
        if from_side {
            page.line(&shown.from_side, "space");
            let at = |along: f64| {
                Point3::new(along * shown.pan.cos(), along * shown.pan.sin(), self.table)
            };
            page.line(&[at(-FAR), at(FAR)], "table");
            page.line(&[at(0.0), Point3::origin()], "arm");
        } else {
            page.line(&shown.from_above, "space");
        }
        if let Some(holder) = self.holder {
            let foot = Point3::new(holder.foot.x, holder.foot.y, self.table);
            page.line(&[foot, Point3::new(foot.x, foot.y, holder.top)], "holder");
        }
        if let (Some([eye, upper, lower, corners @ ..]), Some(skeleton)) =
            (shown.sight, shown.skeleton)
        {
            if from_side {
                page.line(&[eye, upper, lower, eye], "cone");
            } else {
                let [a, b, c, d] = corners;
                page.line(&[a, b, c, d, a], "cone");
                corners
                    .iter()
                    .for_each(|corner| page.line(&[eye, *corner], "edge"));
            }
            let [waist, shoulder, elbow, wrist, tool] = skeleton;
            page.line(&[waist, shoulder, elbow, wrist], "arm");
            page.line(&[wrist, tool], "hand");
            page.line(&[wrist, eye], "bracket");
            for joint in [shoulder, elbow, wrist] {
                page.dot(&joint, 0.014, "joint");
            }
            page.dot(&eye, 0.016, "camera");
        }
        page.line(&shown.way, "path");
        page.dot(&self.ball.centre, self.ball.radius, "ball");
    }
}

/// What both views show, in the world frame.
struct Shown {
    /// The workspace's section with the arm's plane, and its outline from above.
    from_side: [Point3<f64>; 5],
    from_above: Vec<Point3<f64>>,
    /// The way of the tool point.
    way: Vec<Point3<f64>>,
    /// See [`Cell::skeleton`] and [`Cell::sight_lines`].
    skeleton: Option<[Point3<f64>; 5]>,
    sight: Option<[Point3<f64>; 7]>,
    /// `JT1`, radians.
    pan: f64,
}

impl Shown {
    /// The places of arm, camera and way, which either view has room for.
    fn places(&self) -> impl Iterator<Item = Point3<f64>> {
        let eye = self.sight.map(|lines| lines[0]);
        self.skeleton
            .into_iter()
            .flatten()
            .chain(eye)
            .chain(self.way.iter().copied())
    }
}

fn around(rho: f64, azimuth: f64, z: f64) -> Point3<f64> {
    Point3::new(rho * azimuth.cos(), rho * azimuth.sin(), z)
}

/// The outline of the workspace from above.
fn workspace_ring(workspace: &Workspace) -> Vec<Point3<f64>> {
    let ((near, far), (a, b)) = (workspace.rho, workspace.azimuth);
    let arc = |r: f64, from: f64, to: f64| {
        (0..=40).map(move |i| around(r, from + (to - from) * f64::from(i) / 40.0, 0.0))
    };
    arc(near, a, b)
        .chain(arc(far, b, a))
        .chain(arc(near, a, a))
        .collect()
}

impl Cell {
    /// The workspace's section with the arm's plane, which passes the waist axis at the shoulder's
    /// offset; turned by `pan`.
    fn workspace_side(&self, workspace: &Workspace, pan: f64) -> [Point3<f64>; 5] {
        let (low, high) = workspace.height;
        let along = |rho: f64| {
            (rho * rho - self.params.d2 * self.params.d2)
                .max(0.0)
                .sqrt()
        };
        let (near, far) = (along(workspace.rho.0), along(workspace.rho.1));
        let place = |(along, z): (f64, f64)| {
            Isometry3::rotation(Vector3::z() * pan) * Point3::new(along, self.params.d2, z)
        };
        [
            (near, low),
            (far, low),
            (far, high),
            (near, high),
            (near, low),
        ]
        .map(place)
    }

    /// The way of the tool point.
    fn way(&self, path: &[Joints]) -> Vec<Point3<f64>> {
        let finite = path.iter().filter(|joints| joints.non_finite().is_none());
        finite.map(|joints| self.tool_point(joints)).collect()
    }

    /// Shoulder on the waist axis, shoulder in the arm's plane, elbow, wrist and tool point, world
    /// frame.
    fn skeleton(&self, joints: &Joints) -> [Point3<f64>; 5] {
        let waist = Isometry3::rotation(Vector3::z() * joints.0[0]);
        let shoulder = waist * Point3::new(0.0, self.params.d2, 0.0);
        let elbow = Point3::new(
            self.params.a2 * joints.0[1].cos(),
            self.params.d2,
            -self.params.a2 * joints.0[1].sin(),
        );
        let wrist = Point3::from(self.params.wrist(joints).translation.vector);
        [
            Point3::origin(),
            shoulder,
            waist * elbow,
            wrist,
            self.tool_point(joints),
        ]
    }

    /// The camera, and where its sight meets the table above and below the middle of the image and
    /// in its corners, in turn; far away where it does not.
    fn sight_lines(&self, joints: &Joints) -> [Point3<f64>; 7] {
        let pose = self.camera_pose(joints);
        let eye = Point3::from(pose.translation.vector);
        let (w, h) = self.camera.size();
        let (w, h) = (f64::from(w) - 0.5, f64::from(h) - 0.5);
        let end = |x: f64, y: f64| {
            let ray = pose * self.camera.ray(nalgebra::Point2::new(x, y)).normalize();
            let down = if ray.z < 0.0 {
                (self.table - eye.z) / ray.z
            } else {
                f64::INFINITY
            };
            eye + ray * down.clamp(0.0, FAR)
        };
        let x = 0.5 * w;
        [
            eye,
            end(x, -0.5),
            end(x, h),
            end(-0.5, -0.5),
            end(w, -0.5),
            end(w, h),
            end(-0.5, h),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::ball::Ball;

    #[test]
    fn the_section_holds_what_the_workspace_holds_of_the_arms_plane() {
        let (cell, workspace) = (Cell::paper(Ball::at(0.6, 0.0, -0.1)), Workspace::paper());
        for pan in [-0.9_f64, 0.0, 0.4] {
            let section = cell.workspace_side(&workspace, pan);
            let (near, far) = (section[0], section[1]);
            let turn = Isometry3::rotation(Vector3::z() * pan);
            for k in 0..=60 {
                let along = 0.3 + 0.01 * f64::from(k);
                let place = turn * Point3::new(along, cell.params.d2, -0.1);
                let shown = (turn.inverse() * near).x..(turn.inverse() * far).x;
                assert_eq!(
                    workspace.contains(&place),
                    shown.contains(&along),
                    "{pan} {along}"
                );
            }
        }
    }

    #[test]
    fn what_cannot_be_drawn_is_named() {
        let sound = Cell::paper(Ball::at(0.6, 0.0, -0.1));
        let workspace = Workspace::paper();
        assert!(sound.try_overview_svg(&workspace, &[]).is_ok());
        let refused = |change: &dyn Fn(&mut Cell, &mut Workspace)| {
            let (mut cell, mut workspace) = (sound, workspace);
            change(&mut cell, &mut workspace);
            let refused = cell.try_overview_svg(&workspace, &[]);
            refused.expect_err("not to be drawn").to_string()
        };
        assert!(refused(&|cell, _| cell.table = f64::NAN).contains("table"));
        assert!(refused(&|cell, _| cell.ball.centre.x = 1e300).contains("ball's place"));
        assert!(refused(&|cell, _| cell.ball.radius = f64::INFINITY).contains("radius"));
        assert!(refused(&|_, space| space.rho.1 = f64::INFINITY).contains("distance"));
        assert!(refused(&|_, space| space.height = (0.0, 1e9)).contains("height"));
    }
}
