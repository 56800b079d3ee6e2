"""Renders a scene of LuxCore (.cfg, with the .scn that it names).

The engine is PATHCPU, unless the file names another of the CPU."""

import pyluxcore

pyluxcore.Init(lambda message: None)
out = os.path.abspath(arguments.out)
folder, file = os.path.split(os.path.abspath(arguments.scene))
os.chdir(folder)
properties = pyluxcore.Properties(file)


def put(name, value):
    properties.Set(pyluxcore.Property(name, value))


if not properties.IsDefined("renderengine.type") or "CPU" not in properties.Get("renderengine.type").GetString():
    put("renderengine.type", "PATHCPU")
put("renderengine.seed", arguments.seed % 2**31 or 1)
put("batch.haltspp", [arguments.spp, 0])
put("batch.halttime", 0)
put("native.threads.count", arguments.threads or len(os.sched_getaffinity(0)))
put("film.imagepipelines.0.0.type", "NOP")
put("film.outputs.0.type", "RGB")
put("film.outputs.0.filename", out)
if arguments.size:
    put("film.width", arguments.size[0])
    put("film.height", arguments.size[1])
session = pyluxcore.RenderSession(pyluxcore.RenderConfig(properties))
# Starting builds the accelerator.
session.Start()
start = now()
while not session.HasDone():
    time.sleep(0.01)
    session.UpdateStats()
end = now()
session.UpdateStats()
samples = session.GetStats().Get("stats.renderengine.pass").GetInt()
session.Stop()
session.GetFilm().SaveOutput(out, pyluxcore.FilmOutputType.RGB, pyluxcore.Properties())
report([b - a for a, b in zip(start, end)], spp=samples or arguments.spp)
# Its destructors crash when Python ends.
os._exit(0)
