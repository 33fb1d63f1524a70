//! A detector allocates nothing for a frame once it has seen one like it.

#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use hough_heuristic::image::GrayImage;
use hough_heuristic::{
    Acceptance, Canny, CircleDetector, Heuristic, HeuristicConfig, RandomizedHough, RandomizedHoughConfig,
    StandardHough, StandardHoughConfig,
};

#[path = "../scenes/scenes.rs"]
mod scenes;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

/// Counts what this thread asks for.
struct Counting;

// SAFETY: every call goes on to the system's allocator unchanged; counting touches a thread-local number without a destructor.
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

#[test]
fn a_frame_after_the_first_allocates_nothing() {
    let accept = Acceptance {
        max_circles: 8,
        max_radius: 60.0,
        ..Acceptance::default()
    };
    let heuristic = HeuristicConfig {
        max_circles: 8,
        max_radius: 60.0,
        ..HeuristicConfig::default()
    };
    let rht = RandomizedHoughConfig {
        accept,
        ..RandomizedHoughConfig::default()
    };
    let sht = StandardHoughConfig {
        accept,
        gradient: true,
        ..StandardHoughConfig::default()
    };
    let canny = Canny::default;
    let detectors: [(&str, Box<dyn CircleDetector>); 3] = [
        ("heuristic", Box::new(Heuristic::new(heuristic, canny()).unwrap())),
        ("rht", Box::new(RandomizedHough::new(rht, canny()).unwrap())),
        ("sht", Box::new(StandardHough::new(sht, canny()).unwrap())),
    ];
    let scene = scenes::Scene {
        width: 320,
        height: 240,
        balls: 4,
        distractors: 6,
        ..scenes::Scene::default()
    };
    let scene = scenes::Scene {
        radius: (16.0, 40.0),
        ..scene
    };
    let (frame, balls) = scene.render();
    for (name, mut detector) in detectors {
        let mut found = Vec::new();
        let mut count = |frame: &GrayImage| {
            let before = ALLOCATIONS.with(Cell::get);
            detector.detect_into(frame, &mut found);
            (ALLOCATIONS.with(Cell::get) - before, found.len())
        };
        let (first, _) = count(&frame);
        assert!(first > 0, "{name}: the count does not count");
        let (second, circles) = count(&frame);
        assert_eq!(circles, balls.len(), "{name}");
        assert_eq!(second, 0, "{name}");
    }
}
