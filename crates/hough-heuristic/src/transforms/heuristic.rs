//! The paper's detector: sample three edge pixels, look at the edge image itself, keep no
//! accumulator.

use image::GrayImage;

use super::belonging::Probes;
use super::pass::Frames;
use crate::acceptance::Acceptance;
use crate::circle::Circle;
use crate::detect::{CircleDetector, Detection, FrameRefused};
use crate::edges::{Canny, EdgeDetector};
use crate::error::{ConfigError, require_some};
use crate::sampling::Sampler;
use crate::stages::Stages;

/// The settings of [`Heuristic`].
///
/// The defaults suit the paper's frames of 768x576 pixels with one ball of radius 20 to 290 px amid
/// moderate clutter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct HeuristicConfig {
    /// The circles that are reported. The search ends with the last of `max_circles`; if the frame
    /// has fewer, it uses all of `iterations`.
    pub accept: Acceptance,
    /// Triples drawn at most per frame (default 60000; at least 1). Bounds the time; more finds
    /// fainter and smaller balls amid more clutter.
    pub iterations: u32,
    /// Draws all three pixels from the whole of `D`, as the paper does (default false). A circle
    /// that owns the share `p` of all edge pixels is then hit once in `p^-3` draws. With `false`
    /// the second and third pixel come from a window around the first, as wide as a circle of a
    /// radius that is drawn from the range each time (log-uniform). In clutter this hits a small
    /// ball hundreds of times as often.
    pub anywhere: bool,
    /// Seed of the draws (default 1). They begin anew with every frame.
    pub seed: u64,
}

impl Default for HeuristicConfig {
    fn default() -> Self {
        Self {
            accept: Acceptance::default(),
            iterations: 60_000,
            anywhere: false,
            seed: 1,
        }
    }
}

/// The heuristic of section 2.1 of the paper, for circles.
///
/// All edge pixels form the structure `D`. Until the budget is spent: draw three of them, solve for
/// the circle through them, and count how many pixels of that circle are edges. Their share is the
/// *belonging* β; a circle with β above the offset θ is there. Its edge pixels are then taken out
/// of `D`, and the search goes on for the next.
///
/// **How β is counted.** The estimated circle is rasterised by the midpoint rule into a thin
/// outline of about 5.7 pixels per pixel of radius. A pixel of it matches when an edge pixel lies
/// within `tolerance`. β is the share of the matching pixels in all pixels of the outline; those
/// that lie outside the frame count as pixels and never match, so a ball cut in half by the border
/// has a β of at most about one half.
///
/// **Beyond the paper.** A hopeless draw is mostly turned away after a look at 8 to 32 pixels of
/// its outline, which can delay a circle whose β barely exceeds θ but never lets in one that does
/// not; the windows of
/// [`HeuristicConfig::anywhere`]; and the final fit.
///
/// The score of a [`Detection`] is β of the circle as reported. It means the same at every radius.
#[derive(Clone, Debug)]
pub struct Heuristic<E = Canny> {
    iterations: u32,
    probes: Probes,
    sampler: Sampler,
    frames: Frames<E>,
}

impl Heuristic<Canny> {
    /// Builds a detector on the edges of [`Canny`] with its default thresholds.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn with_canny(config: HeuristicConfig) -> Result<Self, ConfigError> {
        Self::new(config, Canny::default())
    }
}

impl<E: EdgeDetector> Heuristic<E> {
    /// Builds a detector on the edges of `edge_detector`, which may be a `Box<dyn EdgeDetector>`.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn new(config: HeuristicConfig, edge_detector: E) -> Result<Self, ConfigError> {
        require_some("iterations", config.iterations as usize)?;
        Ok(Self {
            frames: Frames::new(edge_detector, config.accept)?,
            probes: Probes::new(config.accept.theta),
            sampler: Sampler::new(config.anywhere, &config.accept, config.seed),
            iterations: config.iterations,
        })
    }

    /// Sets whether the detector remembers the candidates of each frame from now on, for
    /// [`stages`](Self::stages). By default it does not.
    pub fn keep_candidates(&mut self, keep: bool) {
        self.frames.keep_candidates(keep);
    }

    /// Returns the stages of the last frame that was searched.
    pub fn stages(&self) -> Stages<'_> {
        self.frames.stages(0)
    }
}

impl<E: EdgeDetector> CircleDetector for Heuristic<E> {
    fn detect(&mut self, frame: &GrayImage) -> Result<&[Detection], FrameRefused> {
        self.frames
            .accept
            .check_frame(frame.width(), frame.height())?;
        self.sampler.restart();
        Ok(self.frames.run(frame, |pass| {
            for _ in 0..self.iterations {
                let Some(drawn) = self.sampler.draw(&pass.unexplained.structure) else {
                    break;
                };
                let near = &pass.unexplained.near;
                let promising = |circle: &Circle| {
                    pass.accept.admits(circle, pass.found) && near.promising(circle, &self.probes)
                };
                let Some(circle) = drawn.filter(promising) else {
                    continue;
                };
                pass.note(circle);
                if pass.report(circle) && pass.is_complete() {
                    break;
                }
            }
        }))
    }
}
