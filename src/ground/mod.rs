//! The living ground: water that runs over a grid of heights, digs, carries and lays down.
//!
//! Two schemes: that of the source (outflow speeds from differences of level) and shallow water (metres and seconds). A host makes a [`Ground`] from
//! a [`GroundState`], records steps into its own encoder, and reads the state back when it wants.

mod camera;
mod options;
mod picture;
mod scene;
mod shape;
mod state;
mod system;

pub use camera::GroundCamera;
pub use options::{Boundary, Erosion, GroundOptions, Scheme, Spring};
pub use picture::{GroundLook, GroundPicture, GroundPictureOptions, Triangulation};
pub use scene::{GroundScene, Shape};
pub use state::{CHANNELS, GroundState};
pub use system::{Ground, GroundEdit, GroundPoint, GroundQuery, GroundReport, Tool};
