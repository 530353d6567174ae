//! Stand-in for the shape table until the geometry room has it.
pub struct Shape {
    pub name: &'static str,
    pub doc: &'static str,
    pub dimension: usize,
    pub default_control_points: &'static [usize],
    pub default_degree: &'static [usize],
    pub default_size: [f64; 3],
    pub fixed_face: &'static str,
}
pub const SHAPES: &[Shape] = &[
    Shape { name: "square", doc: "square membrane", dimension: 2, default_control_points: &[6, 6], default_degree: &[2, 2], default_size: [2.0, 2.0, 0.0], fixed_face: "y+" },
    Shape { name: "circle", doc: "disc", dimension: 2, default_control_points: &[6, 6], default_degree: &[2, 2], default_size: [2.0, 2.0, 0.0], fixed_face: "y+" },
    Shape { name: "ellipse", doc: "elliptic disc", dimension: 2, default_control_points: &[6, 6], default_degree: &[2, 2], default_size: [2.0, 1.0, 0.0], fixed_face: "y+" },
    Shape { name: "cube", doc: "cube", dimension: 3, default_control_points: &[6, 6, 6], default_degree: &[2, 2, 2], default_size: [2.0, 2.0, 2.0], fixed_face: "z+" },
    Shape { name: "torus", doc: "torus", dimension: 3, default_control_points: &[9, 5, 5], default_degree: &[2, 2, 2], default_size: [2.5, 2.5, 0.75], fixed_face: "y+" },
    Shape { name: "spheroid", doc: "coupled spheroid", dimension: 3, default_control_points: &[9, 10, 3], default_degree: &[2, 2, 1], default_size: [4.0, 1.0, 1.0], fixed_face: "z+" },
    Shape { name: "plate", doc: "plate", dimension: 3, default_control_points: &[7, 7, 2], default_degree: &[2, 2, 1], default_size: [2.0, 2.0, 0.2], fixed_face: "x-" },
    Shape { name: "beam", doc: "beam", dimension: 3, default_control_points: &[12, 4, 4], default_degree: &[2, 2, 2], default_size: [6.0, 1.0, 1.0], fixed_face: "x-" },
];
pub fn find(name: &str) -> Option<&'static Shape> {
    SHAPES.iter().find(|shape| shape.name == name)
}
