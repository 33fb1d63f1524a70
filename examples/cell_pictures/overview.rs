//! The cell as a drawing: arm, camera, workspace and ball from the side and from above.

use example_support::prelude::*;
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use pipeline_sim::{Cell, Workspace};
use plotters::coord::Shift;
use plotters::prelude::{SeriesLabelPosition as Pos, *};
use puma_val2::{Joints, PumaParams};

/// Size of each view, pixels; both show 1.8 m by 1.5 m.
const VIEW: (u32, u32) = (600, 500);
/// Longest line of sight that is drawn, metres.
const FAR: f64 = 0.9;

const ARM: RGBColor = RGBColor(59, 91, 122);
const HAND: RGBColor = RGBColor(122, 142, 163);
const CAMERA: RGBColor = RGBColor(34, 34, 34);
const SIGHT: RGBColor = RGBColor(201, 154, 0);
const SPACE: RGBColor = RGBColor(143, 178, 124);
const BALL: RGBColor = RGBColor(216, 69, 59);
const TABLE: RGBColor = RGBColor(138, 111, 77);

/// A line through points of the world, and how it is drawn.
type Line = (&'static str, Vec<Point3<f64>>, ShapeStyle);

/// Draws the cell as SVG with the arm in the last pose of `path`, and the way of its tool point.
pub(crate) fn overview(cell: &Cell, workspace: &Workspace, path: &[Joints]) -> Outcome<String> {
    let joints = path.last().ok_or("a path without poses")?;
    let pan = joints.0[0];
    let mut svg = String::new();
    {
        let size = (2 * VIEW.0, VIEW.1);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let views = root.split_evenly((1, 2));
        // Along the arm's own plane, so that its links show at full length.
        let side = move |p: &Point3<f64>| (p.x * pan.cos() + p.y * pan.sin(), p.z);
        let above = |p: &Point3<f64>| (-p.y, p.x);
        let [eye, upper, lower, corners @ ..] = sight_lines(cell, joints);
        let at = |along: f64| Point3::new(along * pan.cos(), along * pan.sin(), cell.table);
        let (space, sight) = (SPACE.stroke_width(2), SIGHT.stroke_width(1));
        let from_side = [
            ("workspace", section(workspace, pan), space),
            ("table", vec![at(-0.6), at(1.2)], TABLE.stroke_width(3)),
            ("", vec![at(0.0), Point3::origin()], ARM.stroke_width(8)),
            ("field of view", vec![eye, upper, lower, eye], sight),
        ];
        let [a, b, c, d] = corners;
        let from_above = [
            ("workspace", ring(workspace), space),
            (
                "field of view",
                vec![a, b, c, d, a, eye, b, c, eye, d],
                sight,
            ),
        ];
        let both = arm_and_ball(cell, joints, path, eye);
        let lines = from_side.iter().chain(&both);
        let title = "from the side, in the plane of the arm";
        view(
            &views[0],
            (title, Pos::UpperRight),
            (-0.6, -0.75),
            side,
            lines,
            cell,
        )?;
        let lines = from_above.iter().chain(&both);
        view(
            &views[1],
            ("from above", Pos::LowerLeft),
            (-0.9, -0.4),
            above,
            lines,
            cell,
        )?;
        root.present()?;
    }
    Ok(svg)
}

/// Draws one view, whose lower left corner is `corner` in metres, with its legend in a free corner.
fn view<'a>(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    (title, legend): (&str, Pos),
    corner: (f64, f64),
    flat: impl Fn(&Point3<f64>) -> (f64, f64),
    lines: impl Iterator<Item = &'a Line>,
    cell: &Cell,
) -> Outcome {
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 15))
        .margin(8)
        .x_label_area_size(30)
        .y_label_area_size(40)
        .build_cartesian_2d(corner.0..corner.0 + 1.8, corner.1..corner.1 + 1.5)?;
    chart
        .configure_mesh()
        .x_desc("metres")
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(230, 230, 235))
        .draw()?;
    for (name, points, style) in lines {
        let style = *style;
        let drawn = chart.draw_series(LineSeries::new(points.iter().map(&flat), style))?;
        if !name.is_empty() {
            drawn
                .label(*name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
        }
    }
    let ((x, y), radius) = (flat(&cell.ball.centre), cell.ball.radius);
    let around = |i| {
        let (sin, cos) = (f64::from(i) / 40.0 * std::f64::consts::TAU).sin_cos();
        (x + radius * cos, y + radius * sin)
    };
    let round: Vec<(f64, f64)> = (0..=40).map(around).collect();
    chart
        .draw_series([Polygon::new(round, BALL.filled())])?
        .label("ball")
        .legend(|(x, y)| Circle::new((x + 8, y), 5, BALL.filled()));
    chart
        .configure_series_labels()
        .position(legend)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 205))
        .draw()?;
    Ok(())
}

/// Returns the lines that both views show: arm, hand, camera bracket, holder and the tool's way.
fn arm_and_ball(cell: &Cell, joints: &Joints, path: &[Joints], eye: Point3<f64>) -> Vec<Line> {
    let (params, [_, j2, ..]) = (PumaParams::unimation(), joints.0);
    let waist = Isometry3::rotation(Vector3::z() * joints.0[0]);
    let shoulder = waist * Point3::new(0.0, params.d2, 0.0);
    let elbow = waist * Point3::new(params.a2 * j2.cos(), params.d2, -params.a2 * j2.sin());
    let wrist = Point3::from(params.wrist(joints).translation.vector);
    let way = path.iter().map(|joints| cell.tool_point(joints)).collect();
    let arm = vec![Point3::origin(), shoulder, elbow, wrist];
    let hand = vec![wrist, cell.tool_point(joints)];
    let mut lines = vec![
        ("arm", arm, ARM.stroke_width(8)),
        ("hand", hand, HAND.stroke_width(5)),
        ("camera", vec![wrist, eye], CAMERA.stroke_width(2)),
        ("way of the tool point", way, BALL.stroke_width(1)),
    ];
    if let Some(holder) = cell.holder {
        let foot = |z: f64| Point3::new(holder.foot.x, holder.foot.y, z);
        let post = vec![foot(cell.table), foot(holder.top)];
        lines.push(("holder", post, BLACK.stroke_width(3)));
    }
    lines
}

/// Returns the outline of the workspace from above.
fn ring(workspace: &Workspace) -> Vec<Point3<f64>> {
    let ((near, far), (from, to)) = (workspace.rho, workspace.azimuth);
    let arc = |rho: f64, from: f64, to: f64| {
        (0..=40).map(move |i| {
            let (sin, cos) = (from + (to - from) * f64::from(i) / 40.0).sin_cos();
            Point3::new(rho * cos, rho * sin, 0.0)
        })
    };
    let sides = arc(near, from, to).chain(arc(far, to, from));
    sides.chain(arc(near, from, from)).collect()
}

/// Returns the section of the workspace with the arm's plane, which passes the waist axis at the
/// shoulder's offset, turned by `pan`.
fn section(workspace: &Workspace, pan: f64) -> Vec<Point3<f64>> {
    let (d2, (low, high)) = (PumaParams::unimation().d2, workspace.height);
    let along = |rho: f64| (rho * rho - d2 * d2).max(0.0).sqrt();
    let (near, far) = (along(workspace.rho.0), along(workspace.rho.1));
    let turn = Isometry3::rotation(Vector3::z() * pan);
    let corners = [
        (near, low),
        (far, low),
        (far, high),
        (near, high),
        (near, low),
    ];
    corners
        .map(|(along, z)| turn * Point3::new(along, d2, z))
        .into()
}

/// Returns the camera's place, and where its sight meets the table above and below the middle of
/// the image and in its corners, in turn.
fn sight_lines(cell: &Cell, joints: &Joints) -> [Point3<f64>; 7] {
    let pose = cell.camera_pose(joints);
    let eye = Point3::from(pose.translation.vector);
    let (w, h) = cell.camera.size();
    let (w, h) = (f64::from(w) - 0.5, f64::from(h) - 0.5);
    let end = |x: f64, y: f64| {
        let Ok(ray) = cell.camera.ray(Point2::new(x, y)) else {
            return eye;
        };
        let ray = pose * ray.normalize();
        let down = if ray.z < 0.0 {
            (cell.table - eye.z) / ray.z
        } else {
            FAR
        };
        eye + ray * down.clamp(0.0, FAR)
    };
    let x = 0.5 * w;
    let [above, below] = [end(x, -0.5), end(x, h)];
    let corners = [end(-0.5, -0.5), end(w, -0.5), end(w, h), end(-0.5, h)];
    let [a, b, c, d] = corners;
    [eye, above, below, a, b, c, d]
}
