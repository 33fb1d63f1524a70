//! Runs one detection with each circle detector, and one learning.

use hough_heuristic::image::{GrayImage, Luma};
use hough_heuristic::{CircleDetector, Heuristic, HeuristicConfig, detect_circles};
use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
use qtable::{
    EpsilonGreedy, ModelEnvironment, QLearning, QTable, Schedule, Ties, Training, Until,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let frame = GrayImage::from_fn(192, 144, |x, y| {
        let distance = (f64::from(x) - 90.0).hypot(f64::from(y) - 70.0);
        Luma([if distance < 33.0 { 40 } else { 200 }])
    });
    let (found, _) = detect_circles(&frame, 20.0, 60.0)?;
    assert!((found[0].circle.radius - 33.0).abs() < 1.0);
    let mut heuristic = Heuristic::with_canny(HeuristicConfig::default())?;
    assert!((heuristic.detect(&frame)?[0].circle.radius - 33.0).abs() < 1.0);

    let mut cliff = ModelEnvironment::cliff_walking()?;
    let learner = QLearning::new(Schedule::constant(0.5)?, 0.99)?;
    let policy = EpsilonGreedy::new(Schedule::linear(1.0, 0.0, 40_000)?)?.with_ties(Ties::Random);
    let mut training = Training::new(&cliff, QTable::new(48, 4)?, learner, policy)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    training.run(&mut cliff, Until::Actions(50_000), &mut rng)?;
    let [learned, optimal] = cliff.compare(training.table(), 0.99, 500)?;
    assert_eq!(learned.steps, optimal.steps);
    Ok(())
}
