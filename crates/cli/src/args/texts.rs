//! Examples and first steps, as help prints them.

pub const EXAMPLES: &str = "\
Examples:
  steradian render scene.json                      Writes what the scene's \"outputs\" name
  steradian render scene.json -o a.exr -o a.png    Writes these instead
  steradian render scene.xml                       A Mitsuba 3 scene; .pbrt, .gltf and .glb files are read as well
  steradian convert scene.xml scene.json           The same as a JSON scene, to be edited
  steradian info scene.json                        What is in the scene
  steradian replay scene.json 120,80 7             The values of one sample of one pixel
  steradian compare reference.exr test.exr         How far two pictures differ

Scenes to start with: /usr/share/steradian/scenes where the Debian package is installed, scenes in a checkout.

Exit codes: 0 done, 1 internal failure, 2 wrong usage, 3 scene invalid, 4 file missing, 5 output not writable, 6 \
checkpoint or shard does not match, 33 out of memory, 130 interrupted and 143 terminated (with checkpoint and picture \
so far written).";

pub const RENDER_EXAMPLES: &str = "\
Examples:
  steradian render cornell.json --spp 1024 -o cornell.exr
      1024 samples per pixel into a linear multi-layer EXR.
  steradian render cornell.json --time-limit 60 --size 1920x1080 -o a.exr -o a.png
      The best picture a minute can give, as EXR and as PNG.
  steradian render cornell.json --crop 200,100,64,64 --spp 4096
      A close look at one part; each pixel is the same as in the whole picture.
  steradian render cornell.json --integrator ambient_occlusion --spp 16
      The geometry without materials and lights.
  steradian render cornell.json --layers Z,N,albedo --float -o cornell.exr
      Depth, normals and albedo beside the picture, everything in 32 bits.
  steradian render cornell.json --spp 4096 --checkpoint cornell.state --resume
      Whatever ends the render, the same line continues it; a larger --spp adds samples.
  steradian render cornell.json --shard 2/8
      An eighth of the samples into cornell.2-of-8.shard, for steradian merge.
  steradian render cornell.json --set film.filter.type=box --set integrator.rr_depth=8
      Any key of the scene's film, sampler and integrator.
  steradian render cornell.json -q --stats - | jq .mrays_per_second
      Statistics for scripts.

Switches that a scene or a configuration file may set have an opposite, such as --no-denoise or --depth-of-field; the \
last one counts. Without -o and without \"outputs\" in the scene, SCENE.exr and SCENE.png are written to the working \
directory.
Ctrl-C finishes the samples under way and writes the picture; a second one leaves at once.";

pub const RENDER_SHORT_EXAMPLES: &str = "\
Examples:
  steradian render cornell.json -s 1024 -o cornell.exr -o cornell.png
  steradian render cornell.json --time-limit 60 --size 1920x1080 --denoise

These are the common options; `steradian render --help` explains all of them.";

/// What the program prints without arguments.
pub const FIRST_STEPS: &str = "\
Steradian, a physically based path tracer for the CPU

First steps:
  steradian render scene.json -o picture.exr -o picture.png    Render a scene (.json, .xml, .pbrt, .gltf or .glb)
  steradian info scene.json                                    Check a scene: size, camera, contents, cost
  steradian convert scene.xml scene.json                       Turn a Mitsuba, pbrt or glTF scene into JSON
  steradian schema > scene.schema.json                         The scene format, for editors

`steradian render -h` lists the common options, `steradian --help` all commands.";
