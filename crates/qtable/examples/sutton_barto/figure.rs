//! Line charts as SVG.

use std::fmt::Write;

/// The curves of a figure, each with its name.
pub(crate) type Curves = Vec<(String, Vec<(f64, f64)>)>;

const COLOURS: [&str; 6] = [
    "#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#555555",
];
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
/// Right end of the curves; their names stand beyond it.
const RIGHT: f64 = 500.0;

/// Draws curves from 0 to the right, between a lowest and a highest value.
pub(crate) fn draw(
    title: &str,
    axes: [&str; 2],
    curves: &Curves,
    (low, high): (f64, f64),
) -> String {
    let points = || curves.iter().flat_map(|(_, points)| points);
    let right = points()
        .map(|point| point.0)
        .fold(f64::NEG_INFINITY, f64::max);
    let x = |value: f64| 70.0 + value / right * (RIGHT - 70.0);
    let y = |value: f64| HEIGHT - 50.0 - (value - low) / (high - low) * (HEIGHT - 90.0);
    let mut svg = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {WIDTH} {HEIGHT}' \
         font-family='sans-serif' font-size='12'>\n\
         <rect width='{WIDTH}' height='{HEIGHT}' fill='white'/>\n\
         <text x='{}' y='22' text-anchor='middle' font-size='15'>{title}</text>\n",
        WIDTH / 2.0
    );
    for part in 0..=5 {
        let share = f64::from(part) / 5.0;
        let (across, up) = (share * right, low + share * (high - low));
        let (column, row) = (x(across), y(up));
        // Writing to a string does not fail.
        let _ = writeln!(
            svg,
            "<path d='M70 {row:.1}H{}' stroke='#ddd'/>\
             <text x='64' y='{:.1}' text-anchor='end'>{}</text>\
             <text x='{column:.1}' y='{}' text-anchor='middle'>{}</text>",
            RIGHT,
            row + 4.0,
            rounded(up),
            HEIGHT - 32.0,
            rounded(across)
        );
    }
    let middle = HEIGHT / 2.0;
    let _ = writeln!(
        svg,
        "<text x='{}' y='{}' text-anchor='middle'>{}</text>\
         <text x='18' y='{middle}' text-anchor='middle' \
         transform='rotate(-90 18 {middle})'>{}</text>",
        (70.0 + RIGHT) / 2.0,
        HEIGHT - 12.0,
        axes[0],
        axes[1]
    );
    for (index, ((name, points), colour)) in curves.iter().zip(COLOURS).enumerate() {
        let mut line = String::new();
        for &(across, up) in points {
            let _ = write!(line, "{:.1},{:.1} ", x(across), y(up.clamp(low, high)));
        }
        let place = 52.0 + 16.0 * index as f64;
        let _ = writeln!(
            svg,
            "<polyline points='{line}' fill='none' stroke='{colour}' stroke-width='1.5'/>\
             <text x='{}' y='{place}' fill='{colour}'>{name}</text>",
            RIGHT + 10.0
        );
    }
    svg + "</svg>\n"
}

fn rounded(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}
