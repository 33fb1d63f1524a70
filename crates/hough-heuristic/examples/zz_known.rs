#![allow(warnings)]
#[path = "../scenes/scenes.rs"]
mod scenes;
use hough_heuristic::*;
use scenes::*;
fn main() {
    for (w, h, r, d) in [(240, 180, 24.0, 12), (768, 576, 40.0, 20)] {
        for sampling in [Sampling::Near, Sampling::Anywhere] {
            for it in [100u32, 300, 1000, 3000, 10000, 60000] {
                let (mut hit, mut t) = (0, 0.0);
                let mut fp = 0;
                for seed in 0..40u64 {
                    let (f, b) = Scene {
                        width: w,
                        height: h,
                        balls: 1,
                        distractors: d,
                        noise: 3.0,
                        radius: (r, r),
                        seed,
                    }
                    .render();
                    let cfg = RandomizedHoughConfig {
                        accept: Acceptance {
                            min_radius: r,
                            max_radius: r,
                            max_circles: 1,
                            ..Default::default()
                        },
                        sampling,
                        iterations: it,
                        ..Default::default()
                    };
                    let mut det = RandomizedHough::new(cfg, Canny::default()).unwrap();
                    det.detect(&f);
                    let c = det.detect(&f);
                    t += det.stages().unwrap().times.search.as_secs_f64() * 1e3;
                    hit += usize::from(c.iter().any(|x| same(&x.circle, &b[0], 0.5)));
                    fp += c.iter().filter(|x| !same(&x.circle, &b[0], 2.0)).count();
                }
                println!(
                    "{w}x{h} {sampling:?} it {it}: {hit}/40 fp {fp} search {:.3} ms",
                    t / 40.0
                );
            }
        }
    }
}
