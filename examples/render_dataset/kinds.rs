//! Options of `render_dataset`: kinds of frames, sizes, shares.

use std::str::FromStr;

use pipeline_sim::{BenchmarkKind, SceneKind};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// A kind of frame.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    Cell(SceneKind),
    Benchmark(BenchmarkKind),
}

/// One or several kinds, as given on the command line.
#[derive(Clone)]
pub(crate) struct Kinds(pub(crate) Vec<Kind>);

impl FromStr for Kinds {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let all_of_cell = SceneKind::ALL.map(Kind::Cell);
        let all_of_benchmark = BenchmarkKind::ALL.map(Kind::Benchmark);
        Ok(Self(match (name, name.parse(), name.parse()) {
            ("cell", ..) => all_of_cell.to_vec(),
            ("benchmark", ..) => all_of_benchmark.to_vec(),
            (_, Ok(kind), _) => vec![Kind::Cell(kind)],
            (_, _, Ok(kind)) => vec![Kind::Benchmark(kind)],
            (_, Err(of_cell), Err(of_benchmark)) => {
                return Err(format!(
                    "unknown kind; known are cell: {}; benchmark: {}",
                    of_cell.known, of_benchmark.known
                ));
            }
        }))
    }
}

impl Kind {
    pub(crate) fn name(self) -> String {
        match self {
            Self::Cell(kind) => kind.to_string(),
            Self::Benchmark(kind) => kind.to_string(),
        }
    }

    /// Returns a generator that no other kind and no other seed shares.
    pub(crate) fn generator(self, seed: u64) -> Xoshiro256PlusPlus {
        // FNV-1a over the name and the seed.
        let bytes = self
            .name()
            .into_bytes()
            .into_iter()
            .chain(seed.to_le_bytes());
        let hash = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Xoshiro256PlusPlus::seed_from_u64(hash)
    }
}

/// Returns the first kind that is named twice: its files would be overwritten.
pub(crate) fn repeated(kinds: &[Kind]) -> Option<String> {
    let names: Vec<String> = kinds.iter().map(|kind| kind.name()).collect();
    let again = (1..names.len()).find(|i| names[..*i].contains(&names[*i]));
    again.map(|i| names[i].clone())
}

/// Parses a share from 0 to 1.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text
        .parse()
        .ok()
        .filter(|share| (0.0..=1.0).contains(share));
    number.ok_or_else(|| format!("{text} is not a share from 0 to 1"))
}

/// Parses width and height, as in `768x576`.
pub(crate) fn size(text: &str) -> Result<(u32, u32), String> {
    let number = |part: &str| part.parse().ok().filter(|n| (16..=8192).contains(n));
    text.split_once('x')
        .and_then(|(width, height)| Some((number(width)?, number(height)?)))
        .ok_or_else(|| format!("{text} is not a size such as 768x576, from 16 to 8192 pixels each"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng as _;

    fn kinds_of(list: &str) -> Vec<Kind> {
        let kinds = list
            .split(',')
            .map(|name| name.parse::<Kinds>().expect("known"));
        kinds.flat_map(|k| k.0).collect()
    }

    #[test]
    fn shares_sizes_and_kinds_that_make_no_sense_are_refused() {
        for text in ["-0.1", "1.01", "nan", "inf", "much"] {
            let refused = share(text).expect_err("no share");
            assert!(refused.contains(text), "{refused}");
        }
        assert_eq!(share("0"), Ok(0.0));
        assert_eq!(share("1"), Ok(1.0));
        for text in ["768", "768x", "15x100", "100x8193", "-1x100"] {
            let refused = size(text).expect_err("no size");
            assert!(refused.contains(text), "{refused}");
        }
        assert_eq!(size("768x576"), Ok((768, 576)));
        assert_eq!(repeated(&kinds_of("cell,benchmark")), None);
        assert_eq!(repeated(&kinds_of("cell,plain")).as_deref(), Some("plain"));
        assert_eq!(
            repeated(&kinds_of("clean,many,clean")).as_deref(),
            Some("clean")
        );
    }

    #[test]
    fn no_two_kinds_and_no_two_seeds_share_their_draws() {
        let mut first: Vec<u64> = kinds_of("cell,benchmark")
            .iter()
            .flat_map(|kind| [1, 2].map(|seed| kind.generator(seed).next_u64()))
            .collect();
        let count = first.len();
        first.sort_unstable();
        first.dedup();
        assert_eq!(first.len(), count);
    }
}
