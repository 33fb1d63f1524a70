//! A detector allocates nothing for a frame once it has seen one like it.

#![allow(unsafe_code)]
#![allow(
    clippy::unwrap_used,
    reason = "a test may fail that way, also in a function that several tests share"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use hough_heuristic::image::GrayImage;
use hough_heuristic::{AContrario, AContrarioConfig, Acceptance, Canny, CircleDetector};

use circle_scenes::scene::Scene;
use circle_scenes::staged::{Staged, TRANSFORMS, transform};

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

/// Counts what this thread asks for.
struct Counting;

// SAFETY: every call goes on to the system's allocator unchanged; counting touches a thread-local
// number without a destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promise is handed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is handed on.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promise is handed on.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn detectors() -> [(&'static str, Box<dyn Staged>); 6] {
    let accept = Acceptance {
        max_radius: 60.0,
        max_circles: 8,
        ..Acceptance::default()
    };
    TRANSFORMS.map(|name| (name, transform(name, accept, Canny::default()).unwrap()))
}

fn frame(width: u32, height: u32, balls: usize, distractors: usize, seed: u64) -> GrayImage {
    let scene = Scene {
        width,
        height,
        balls,
        distractors,
        radius: (16.0, 30.0),
        seed,
        ..Scene::default()
    };
    scene.render().0
}

/// Counts the allocations for a frame, and its circles.
fn allocations(detector: &mut dyn CircleDetector, frame: &GrayImage) -> (usize, usize) {
    let before = ALLOCATIONS.with(Cell::get);
    let circles = detector.detect(frame).unwrap().len();
    (ALLOCATIONS.with(Cell::get) - before, circles)
}

fn edges(detector: &mut dyn Staged, frame: &GrayImage) -> usize {
    detector.detect(frame).unwrap();
    detector.stages().edges.pixels().len()
}

#[test]
fn the_a_contrario_detector_allocates_for_the_first_frame_only() {
    let mut detector = AContrario::new(AContrarioConfig::default()).unwrap();
    let crowded = frame(500, 400, 8, 25, 1);
    let (first, circles) = allocations(&mut detector, &crowded);
    assert!(first > 0 && circles > 0);
    for other in [
        frame(320, 240, 4, 6, 2),
        frame(90, 200, 1, 1, 4),
        GrayImage::new(0, 0),
        frame(300, 400, 5, 3, 6),
        crowded.clone(),
    ] {
        assert_eq!(allocations(&mut detector, &other).0, 0);
    }
    let last = detector.measurements()[0].circle;
    detector.track(&crowded, &last, 5.0).unwrap();
    let before = ALLOCATIONS.with(Cell::get);
    assert!(detector.track(&crowded, &last, 5.0).unwrap());
    assert_eq!(ALLOCATIONS.with(Cell::get), before);
}

/// The first frames are the busiest: one has the most edges, one takes all draws. Those after them
/// are new to the detector, differ in size, and come back in another order.
#[test]
fn a_frame_after_the_first_allocates_nothing() {
    let (crowded, futile) = (frame(500, 400, 8, 25, 1), frame(400, 300, 0, 8, 1));
    let others = [
        frame(320, 240, 4, 6, 2),
        frame(400, 300, 3, 4, 3),
        frame(90, 200, 1, 1, 4),
        frame(200, 90, 1, 2, 5),
        GrayImage::new(0, 0),
        GrayImage::new(400, 1),
        frame(300, 400, 5, 3, 6),
    ];
    for (name, mut detector) in detectors() {
        let (first, found) = allocations(&mut *detector, &crowded);
        assert!(first > 0, "{name}: the count does not count");
        assert!(found >= 5, "{name}: {found}");
        allocations(&mut *detector, &futile);
        let mut circles = 0;
        let most = edges(&mut *detector, &crowded);
        for (index, frame) in others.iter().chain(others.iter().rev()).enumerate() {
            let (count, found) = allocations(&mut *detector, frame);
            assert_eq!(count, 0, "{name}, frame {index}");
            circles += found;
            let stages = detector.stages();
            assert!(
                stages.edges.pixels().len() < most,
                "{name}, frame {index} is the busiest"
            );
        }
        assert!(circles >= 20, "{name}: {circles}");
    }
}

#[test]
fn remembered_candidates_keep_their_memory() {
    let frames = [frame(320, 240, 4, 6, 2), frame(200, 150, 2, 2, 3)];
    for (name, mut detector) in detectors() {
        detector.keep_candidates(true);
        for frame in &frames {
            allocations(&mut *detector, frame);
        }
        for frame in frames.iter().rev() {
            assert_eq!(allocations(&mut *detector, frame).0, 0, "{name}");
            assert!(!detector.stages().candidates.is_empty(), "{name}");
        }
    }
}
