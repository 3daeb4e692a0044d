Heights of given places of a ball. Nothing is drawn; the host finds where each place lies on the ball's lattice.

#PROGRAM{ terrain_globe_heights }#

#COMPUTE{
    #CODE{
#import veduta::terrain::globe::{Globe, globe_ground}

override FIELD_KIND: i32 = 2;

struct GlobeRow {
    cell: vec3<i32>,
    footprint: f32,
    frac: vec3<f32>,
    up: vec3<f32>,
}

struct GlobeGroundRow {
    slope: vec3<f32>,
    height: f32,
    lost: f32,
}

@group(0) @binding(0) var<uniform> globe: Globe;
@group(1) @binding(0) var<storage, read> places: array<GlobeRow>;
@group(2) @binding(0) var<storage, read_write> results: array<GlobeGroundRow>;

@compute @workgroup_size(64)
fn find(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&places) {
        return;
    }
    let place = places[id.x];
    let ground = globe_ground(globe, FIELD_KIND, place.cell, place.frac, place.up, place.footprint);
    results[id.x] = GlobeGroundRow(ground.slope, ground.height, ground.lost);
}
    }#
}#
