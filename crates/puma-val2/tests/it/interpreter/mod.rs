//! Every instruction and function, in stored programs and through `DO`.

mod blending;
mod dialects;
mod motions;
mod programs;
mod published;
mod reactions;
mod texts;
