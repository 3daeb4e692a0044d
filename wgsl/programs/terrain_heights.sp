Heights of given places of a terrain. Nothing is drawn; the host splits each place into cell and fraction, so that it may be anywhere.

#PROGRAM{ terrain_heights }#

#COMPUTE{
    #CODE{
#import veduta::terrain::field::{Field}
#import veduta::terrain::relief::{land_at}

override FIELD_KIND: i32 = 2;

struct PlaceRow {
    cell: vec2<i32>,
    frac: vec2<f32>,
    footprint: f32,
}

struct GroundRow {
    height: f32,
    lost: f32,
    slope: vec2<f32>,
}

@group(0) @binding(0) var<uniform> field: Field;
@group(1) @binding(0) var<storage, read> places: array<PlaceRow>;
@group(1) @binding(1) var relief: texture_2d<f32>;
@group(2) @binding(0) var<storage, read_write> results: array<GroundRow>;

@compute @workgroup_size(64)
fn find(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&places) {
        return;
    }
    let place = places[id.x];
    var here = field;
    here.cell = place.cell;
    here.frac = place.frac;
    let ground = land_at(relief, here, FIELD_KIND, vec2<f32>(0.0), place.footprint);
    results[id.x] = GroundRow(ground.height, ground.lost, ground.slope);
}
    }#
}#
