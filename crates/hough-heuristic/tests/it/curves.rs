use hough_heuristic::image::{GrayImage, Luma};
use hough_heuristic::{Circle, Curve, CurveSearch, CurveSearchConfig, EdgeMap, Ellipse, Line};

/// An edge image with these curves' outlines and a few stray pixels.
fn edges(draw: impl Fn(&mut dyn FnMut(i32, i32))) -> EdgeMap {
    let mut image = GrayImage::from_fn(200, 150, |x, y| {
        Luma([if (x * 31 + y * 17) % 97 == 0 { 255 } else { 0 }])
    });
    draw(&mut |x, y| {
        if (0..200).contains(&x) && (0..150).contains(&y) {
            image.put_pixel(x as u32, y as u32, Luma([255]));
        }
    });
    EdgeMap::from_image(&image)
}

fn draw<C: Curve>(curve: &C, plot: &mut dyn FnMut(i32, i32)) {
    curve.outline(200, 150, |x, y| {
        plot(x, y);
        true
    });
}

const CONFIG: CurveSearchConfig = CurveSearchConfig {
    theta: 0.8,
    iterations: 200_000,
    tolerance: 1.0,
    max_curves: 5,
    reach: None,
    seed: 3,
};

#[test]
fn lines_are_found_and_taken_out() {
    let truth = [(0.6f64, 80.0), (2.1, -20.0), (1.57, 60.0)].map(|(direction, rho)| Line {
        cos: direction.cos(),
        sin: direction.sin(),
        rho,
    });
    let map = edges(|plot| truth.iter().for_each(|line| draw(line, plot)));
    let found = CurveSearch::new(CONFIG)
        .unwrap()
        .find::<Line>(&map, |_| true);
    assert_eq!(found.len(), 3, "{found:?}");
    for line in truth {
        assert!(found.iter().any(|(f, _)| {
            let turn = f.cos * line.cos + f.sin * line.sin;
            turn.abs() > 0.999 && (f.rho - line.rho * turn.signum()).abs() < 2.0
        }));
    }
}

#[test]
fn circles_and_ellipses_are_found() {
    let circle = Circle {
        x: 60.0,
        y: 70.0,
        radius: 40.0,
    };
    let ellipse = Ellipse {
        x: 120.0,
        y: 80.0,
        major: 60.0,
        minor: 30.0,
        angle: 0.4,
    };
    let map = edges(|plot| {
        draw(&circle, plot);
        draw(&ellipse, plot);
    });
    let mut search = CurveSearch::new(CONFIG).unwrap();
    let circles =
        search.find::<Circle>(&map, |circle| circle.radius > 10.0 && circle.radius < 80.0);
    assert_eq!(circles.len(), 1, "{circles:?}");
    assert!((circles[0].0.x - 60.0).abs() < 1.0 && (circles[0].0.radius - 40.0).abs() < 1.0);
    assert!(circles[0].1 > 0.8 && circles[0].1 <= 1.0);

    let ellipses = search.find::<Ellipse>(&map, |e| {
        e.minor > 20.0 && e.major < 80.0 && e.minor < 0.7 * e.major
    });
    assert_eq!(ellipses.len(), 1, "{ellipses:?}");
    let found = ellipses[0].0;
    assert!(
        (found.x - 120.0).abs() < 2.0 && (found.major - 60.0).abs() < 2.0,
        "{found:?}"
    );
    assert!((found.angle - 0.4).abs() < 0.1);
}

#[test]
fn same_seed_same_curves_and_nothing_in_nothing() {
    let map = edges(|_| ());
    let config = CurveSearchConfig {
        theta: 0.2,
        iterations: 2000,
        reach: Some(20.0),
        ..CONFIG
    };
    let mut search = CurveSearch::new(config).unwrap();
    let first = search.find::<Line>(&map, |_| true);
    assert_eq!(search.find::<Line>(&EdgeMap::default(), |_| true), []);
    assert_eq!(search.find::<Line>(&map, |_| true), first);
    assert!(
        CurveSearch::new(CurveSearchConfig {
            iterations: 0,
            ..CONFIG
        })
        .is_err()
    );
    assert!(
        CurveSearch::new(CurveSearchConfig {
            reach: Some(f64::NAN),
            ..CONFIG
        })
        .is_err()
    );
}
