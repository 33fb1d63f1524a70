//! The three transforms behind one trait, stages included.

use hough_heuristic::{
    CircleDetector, EdgeDetector, Heuristic, RandomizedHough, Stages, StandardHough,
};

pub trait Staged: CircleDetector {
    fn stages(&self) -> Stages<'_>;
    fn keep_candidates(&mut self, keep: bool);
}

macro_rules! staged {
    ($($detector:ident)*) => {$(
        impl<E: EdgeDetector> Staged for $detector<E> {
            fn stages(&self) -> Stages<'_> {
                self.stages()
            }

            fn keep_candidates(&mut self, keep: bool) {
                self.keep_candidates(keep);
            }
        }
    )*};
}

staged!(Heuristic RandomizedHough StandardHough);
