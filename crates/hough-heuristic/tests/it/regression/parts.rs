//! Parts of larger things that are round.

use super::{PLAIN, assert_found, circle, within};

#[test]
fn a_lobe_of_a_larger_thing_is_no_circle() {
    for shift in [0.0, 0.5] {
        let lobe = circle(80.0 + shift, 100.0, 30.0);
        let frame = PLAIN.draw(|x, y| {
            let body = (y - 100.0).abs() < 27.0 && x > lobe.x && x < 180.0;
            if within(&lobe, x, y) || body {
                60.0
            } else {
                170.0
            }
        });
        assert_found("lobe", &frame, &[]);
    }
}

#[test]
fn fingertips_are_no_circles() {
    for (size, narrowing, shade) in [(24.0, 0.22, 0.0), (30.0, 0.2, 0.0), (33.0, 0.0, 0.5)] {
        for x in [64.0, 64.5] {
            let tip = circle(x, 98.0, size);
            let frame = PLAIN.draw(|x, y| {
                let (u, v) = (x - tip.x, y - tip.y);
                let (u, v) = (0.96 * u + 0.28 * v, 0.96 * v - 0.28 * u);
                let side = v.abs() + narrowing * u.max(0.0);
                if within(&tip, x, y) || (u > 0.0 && u < 2.6 * size && side < size) {
                    return 140.0 + shade * (u + v);
                }
                60.0
            });
            assert_found("fingertip", &frame, &[]);
        }
    }
}
