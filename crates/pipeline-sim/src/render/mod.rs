//! Frames of the cell: table, things, holder and ball as the camera on the hand sees them.

pub(crate) mod ball_shadow;
pub(crate) mod blur;
pub(crate) mod bodies;
pub(crate) mod canvas;
pub(crate) mod lens;
pub(crate) mod light_grid;
pub(crate) mod picture;
pub(crate) mod renderer;
pub(crate) mod scene;
pub(crate) mod scene_check;
pub(crate) mod sensor;
pub(crate) mod shadow;
pub(crate) mod shot;
pub(crate) mod sphere;
pub(crate) mod texture;
pub(crate) mod truth;
pub(crate) mod view;
