//! The cell as a drawing.

use std::fmt::Write as _;

use nalgebra::{Isometry3, Point3, Vector3};
use puma_val2::Joints;

use crate::{Cell, Workspace};

/// Pixels per metre of the drawing.
const SCALE: f64 = 340.0;
/// Width of each of the two views, and their height, pixels.
const VIEW: (f64, f64) = (560.0, 470.0);
/// Height of the legend below both views, pixels.
const LEGEND: f64 = 34.0;
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
}

impl Page<'_> {
    fn line(&mut self, points: &[Point3<f64>], class: &str) {
        let points: Vec<(f64, f64)> = points.iter().map(|p| (self.place)(p)).collect();
        self.stroke(&points, class);
    }

    /// A line through places of the page.
    fn stroke(&mut self, points: &[(f64, f64)], class: &str) {
        let points: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
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
            radius * SCALE
        );
    }

    fn label(&mut self, x: f64, y: f64, words: &str) {
        let _ = writeln!(self.text, r#"<text x="{x:.0}" y="{y:.0}">{words}</text>"#);
    }
}

/// Names what is drawn, below both views.
fn legend(text: &mut String) {
    let y = VIEW.1 + 0.5 * LEGEND;
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
    /// Draws the cell as SVG: the arm from the side (in its own vertical plane) and from above, the camera's field of view, the workspace, the
    /// ball, and the way of the tool point through `path`, whose last pose is the one drawn; with scale bars and a legend.
    ///
    /// An empty path, or one with angles that are not finite, gives a drawing without the arm.
    pub fn overview_svg(&self, workspace: &Workspace, path: &[Joints]) -> String {
        let (width, height) = (2.0 * VIEW.0, VIEW.1 + LEGEND);
        let mut text = format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}">
<style>
rect{{fill:#fff}} text{{font:13px sans-serif;fill:#333}} polyline{{fill:none;stroke-linejoin:round;stroke-linecap:round}}
.arm{{stroke:#3b5b7a;stroke-width:9}} .hand{{stroke:#7a8ea3;stroke-width:5}} .bracket{{stroke:#222;stroke-width:2}} .joint{{fill:#20364a}} .space{{fill:#e8f1e4;stroke:#8fb27c;stroke-width:1}}
.cone{{fill:#f4c430;fill-opacity:.25;stroke:#c99a00;stroke-width:1}} .ball{{fill:#d8453b}} .holder{{stroke:#777;stroke-width:4}}
.table{{stroke:#8a6f4d;stroke-width:3}} .path{{stroke:#d8453b;stroke-width:1.5;stroke-dasharray:4 3}} .camera{{fill:#222}} .bar{{stroke:#333;stroke-width:1.5}}
</style>
<rect width="{width}" height="{height}"/>
"##
        );
        let pose = path.last().filter(|joints| joints.non_finite().is_none());
        let pan = pose.map_or(0.0, |joints| joints.0[0]);
        // From the side: along the arm's own plane, so that its links show at full length.
        let side = move |p: &Point3<f64>| {
            let along = p.x * pan.cos() + p.y * pan.sin();
            (120.0 + along * SCALE, 310.0 - p.z * SCALE)
        };
        // From above: x up, y to the left.
        let above = |p: &Point3<f64>| (VIEW.0 + 280.0 - p.y * SCALE, 390.0 - p.x * SCALE);
        let views: [(&str, Placement); 2] = [
            ("from the side, in the plane of the arm", Box::new(side)),
            ("from above", Box::new(above)),
        ];
        for (k, (name, place)) in views.into_iter().enumerate() {
            let mut page = Page {
                text: &mut text,
                place,
            };
            self.draw_view(&mut page, k == 0, pan, workspace, path, pose);
            let left = VIEW.0 * k as f64;
            page.label(left + 16.0, VIEW.1 - 14.0, name);
            let (end, y) = (left + VIEW.0 - 24.0, VIEW.1 - 18.0);
            let bar = [
                (end - BAR * SCALE, y - 4.0),
                (end - BAR * SCALE, y),
                (end, y),
                (end, y - 4.0),
            ];
            page.stroke(&bar, "bar");
            page.label(end - 0.5 * BAR * SCALE - 16.0, y - 5.0, &format!("{BAR} m"));
        }
        legend(&mut text);
        text.push_str("</svg>\n");
        text
    }

    fn draw_view(
        &self,
        page: &mut Page<'_>,
        from_side: bool,
        pan: f64,
        workspace: &Workspace,
        path: &[Joints],
        pose: Option<&Joints>,
    ) {
        let at = |rho: f64, azimuth: f64, z: f64| Point3::new(rho * azimuth.cos(), rho * azimuth.sin(), z);
        let (rho, z) = (workspace.rho, workspace.height);
        if from_side {
            let corners = [
                (rho.0, z.0),
                (rho.1, z.0),
                (rho.1, z.1),
                (rho.0, z.1),
                (rho.0, z.0),
            ];
            page.line(&corners.map(|(r, z)| at(r, pan, z)), "space");
            page.line(&[at(-0.3, pan, self.table), at(1.2, pan, self.table)], "table");
            page.line(&[at(0.0, pan, self.table), at(0.0, pan, 0.0)], "arm");
        } else {
            let arc = |r: f64, from: f64, to: f64| {
                (0..=40).map(move |i| at(r, from + (to - from) * f64::from(i) / 40.0, 0.0))
            };
            let (a, b) = workspace.azimuth;
            let ring: Vec<_> = arc(rho.0, a, b)
                .chain(arc(rho.1, b, a))
                .chain(arc(rho.0, a, a))
                .collect();
            page.line(&ring, "space");
        }
        if let Some(holder) = self.holder {
            let foot = Point3::new(holder.foot.x, holder.foot.y, self.table);
            page.line(&[foot, Point3::new(foot.x, foot.y, holder.top)], "holder");
        }
        if let Some(joints) = pose {
            let cone = self.sight_lines(joints);
            if from_side {
                page.line(&[cone[0], cone[1], cone[2], cone[0]], "cone");
            } else {
                page.line(&[cone[0], cone[3], cone[4], cone[0]], "cone");
            }
            let [waist, shoulder, elbow, wrist, tool] = self.skeleton(joints);
            page.line(&[waist, shoulder, elbow, wrist], "arm");
            page.line(&[wrist, tool], "hand");
            page.line(&[wrist, cone[0]], "bracket");
            for joint in [shoulder, elbow, wrist] {
                page.dot(&joint, 0.014, "joint");
            }
            page.dot(&cone[0], 0.016, "camera");
        }
        let finite = path.iter().filter(|joints| joints.non_finite().is_none());
        let way: Vec<_> = finite.map(|joints| self.tool_point(joints)).collect();
        page.line(&way, "path");
        page.dot(&self.ball.centre, self.ball.radius, "ball");
    }
}

impl Cell {
    /// Shoulder on the waist axis, shoulder in the arm's plane, elbow, wrist and tool point, world frame.
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

    /// The camera, and where its sight ends above, below, left and right of the middle of the image: on the table, or after 0.9 m.
    fn sight_lines(&self, joints: &Joints) -> [Point3<f64>; 5] {
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
            eye + ray * down.clamp(0.0, 0.9)
        };
        let (x, y) = (0.5 * w, 0.5 * h);
        [eye, end(x, -0.5), end(x, h), end(-0.5, y), end(w, y)]
    }
}
