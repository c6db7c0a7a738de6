#!/usr/bin/python3
"""Jets of waste gas in a crossflow (one, two in line, three abreast), solved by OpenFOAM's pisoFoam
with a passive scalar, on the grids of Liao et al. 2004 (81x49x65, 101x49x81, 81x65x65; 100 steps).

  apt-get install --no-install-recommends openfoam python3-numpy     (and python3-openvdb for --vdb)
  /usr/bin/python3 scripts/make_jets.py OUT_DIR [1 2 3] [--steps 100] [--vdb] [--keep]

Leaves OUT_DIR/jetN/raw/jetN_0000.raw ... (u8, x fastest, then y, then z) and OUT_DIR/jetN/jetN.json;
with --vdb also OUT_DIR/jetN/vdb/jetN_0000.vdb ... (FloatGrid `density`, 0..1, background 0).
Axes: x along the crossflow, y across it, z up (the jets issue along +z). Lengths are in jet diameters.
A sequence takes 5 to 10 minutes of one core.
"""
import argparse
import json
import os
import shutil
import subprocess
import sys
import time

import numpy as np

H = 0.125                 # cell edge: 8 cells per jet diameter
R = 2.5                   # jet speed / crossflow speed
DT, EVERY = 0.032, 5     # solver step; steps per output
NU = 5e-4                 # jet Reynolds number 5000
PRUNE = 1e-3              # of the VDB files: below half of a u8 step

# cells, and the cell under whose centre each jet's axis lies
CASES = {1: ((81, 49, 65), [(14, 24)]),
         2: ((101, 49, 81), [(12, 24), (36, 24)]),
         3: ((81, 65, 65), [(14, 14), (14, 32), (14, 50)])}

HEAD = "FoamFile {{ version 2.0; format ascii; class {cls}; object {obj}; }}\n"


def put(case, path, cls, text):
    p = os.path.join(case, path)
    os.makedirs(os.path.dirname(p), exist_ok=True)
    with open(p, "w") as f:
        f.write(HEAD.format(cls=cls, obj=os.path.basename(path)) + text)


def write_case(case, n, steps):
    (nx, ny, nz), jets = CASES[n]
    X, Y, Z = nx * H, ny * H, nz * H
    v = [(0, 0, 0), (X, 0, 0), (X, Y, 0), (0, Y, 0), (0, 0, Z), (X, 0, Z), (X, Y, Z), (0, Y, Z)]
    verts = " ".join("(%.10g %.10g %.10g)" % p for p in v)
    put(case, "system/blockMeshDict", "dictionary", f"""
scale 1;
vertices ({verts});
blocks (hex (0 1 2 3 4 5 6 7) ({nx} {ny} {nz}) simpleGrading (1 1 1));
edges ();
boundary
(
  inlet  {{ type patch; faces ((0 4 7 3)); }}
  outlet {{ type patch; faces ((1 2 6 5)); }}
  ground {{ type wall;  faces ((0 3 2 1)); }}
  top    {{ type patch; faces ((4 5 6 7)); }}
  sides  {{ type patch; faces ((0 1 5 4) (3 7 6 2)); }}
);
""")
    acts = ""
    for i, (ci, cj) in enumerate(jets):
        x, y = (ci + 0.5) * H, (cj + 0.5) * H
        acts += (f"{{ name jets; type faceSet; action {'add' if i else 'new'}; source cylinderToFace; sourceInfo "
                 f"{{ p1 ({x} {y} -0.01); p2 ({x} {y} 0.01); radius {0.5 + 1e-6}; }} }}\n")
    acts += "{ name jets; type faceSet; action subset; source patchToFace; sourceInfo { patch ground; } }\n"
    put(case, "system/topoSetDict", "dictionary", f"actions\n(\n{acts});\n")
    put(case, "system/createPatchDict", "dictionary", """
pointSync false;
patches ( { name jet; patchInfo { type patch; } constructFrom set; set jets; } );
""")
    put(case, "system/controlDict", "dictionary", f"""
application pisoFoam;
startFrom startTime; startTime 0; stopAt endTime; endTime {steps * EVERY * DT:.10g};
deltaT {DT};
writeControl timeStep; writeInterval 1000000; purgeWrite 0;
writeFormat binary; writePrecision 9; writeCompression off;
timeFormat general; timePrecision 9; runTimeModifiable false;
functions
{{
  gas   {{ type scalarTransport; libs (solverFunctionObjects); field wasteGas; schemesField wasteGas;
           nCorr 0; alphaD 1; alphaDt 1.4; resetOnStartUp false; }}
  write {{ type writeObjects; libs (utilityFunctionObjects); objects (wasteGas); writeOption anyWrite;
           writeControl timeStep; writeInterval {EVERY}; }}
}}
""")
    put(case, "system/fvSchemes", "dictionary", """
ddtSchemes { default backward; }
gradSchemes { default Gauss linear; }
divSchemes
{
  default none;
  div(phi,U) Gauss LUST grad(U);
  div(phi,wasteGas) Gauss limitedLinear01 1;
  div((nuEff*dev2(T(grad(U))))) Gauss linear;
}
laplacianSchemes { default Gauss linear orthogonal; }
interpolationSchemes { default linear; }
snGradSchemes { default orthogonal; }
""")
    put(case, "system/fvSolution", "dictionary", """
solvers
{
  p      { solver GAMG; smoother GaussSeidel; tolerance 1e-5; relTol 0.05; }
  pFinal { $p; relTol 0.01; }
  "(U|wasteGas)(Final)?" { solver smoothSolver; smoother symGaussSeidel; tolerance 1e-6; relTol 0.01; }
}
PISO { nCorrectors 2; nNonOrthogonalCorrectors 0; }
""")
    put(case, "constant/transportProperties", "dictionary", f"transportModel Newtonian;\nnu {NU};\n")
    put(case, "constant/turbulenceProperties", "dictionary", """
simulationType LES;
LES { LESModel WALE; turbulence on; printCoeffs on; delta cubeRootVol; cubeRootVolCoeffs { deltaCoeff 1; } }
""")
    def field(name, cls, dim, internal, **bc):
        b = "\n".join(f"  {k} {{ {t} }}" for k, t in bc.items())
        put(case, "0/" + name, cls, f"dimensions {dim};\ninternalField uniform {internal};\nboundaryField\n{{\n{b}\n}}\n")
    zg, slip = "type zeroGradient;", "type slip;"
    field("U", "volVectorField", "[0 1 -1 0 0 0 0]", "(1 0 0)",
          inlet="type fixedValue; value uniform (1 0 0);",
          outlet="type inletOutlet; inletValue uniform (0 0 0); value uniform (1 0 0);",
          ground="type noSlip;", top=slip, sides=slip,
          jet=f"type turbulentInlet; referenceField uniform (0 0 {R}); fluctuationScale (0.08 0.08 0.08); "
              f"alpha 0.1; value uniform (0 0 {R});")
    field("p", "volScalarField", "[0 2 -2 0 0 0 0]", "0",
          inlet=zg, outlet="type fixedValue; value uniform 0;", ground=zg, top=zg, sides=zg, jet=zg)
    calc = "type calculated; value uniform 0;"
    field("nut", "volScalarField", "[0 2 -1 0 0 0 0]", "0",
          inlet=calc, outlet=calc, ground=calc, top=calc, sides=calc, jet=calc)
    field("wasteGas", "volScalarField", "[0 0 0 0 0 0 0]", "0",
          inlet="type fixedValue; value uniform 0;",
          outlet="type inletOutlet; inletValue uniform 0; value uniform 0;",
          ground=zg, top=zg, sides=zg, jet="type fixedValue; value uniform 1;")


def foam(case, *cmd):
    env = dict(os.environ)
    env.setdefault("WM_PROJECT_DIR", "/usr/share/openfoam")   # where Debian keeps etc/
    log = os.path.join(case, "log." + cmd[0])
    with open(log, "w") as f:
        rc = subprocess.call(cmd, cwd=case, env=env, stdout=f, stderr=subprocess.STDOUT)
    if rc:
        sys.stderr.write(open(log).read()[-3000:])
        sys.exit(f"{cmd[0]} failed ({rc}), see {log}")


def read_field(path, n):
    """internalField of a volScalarField, binary or ascii, as n float64."""
    b = open(path, "rb").read()
    i = b.index(b"internalField")
    head = b[i:i + 200]
    if head.split()[1] == b"uniform":
        return np.full(n, float(head.split()[2].rstrip(b";")))
    j = b.index(b"(", i)
    count = int(b[i:j].split()[-1])
    assert count == n, (path, count, n)
    if b"format      ascii" in b[:i] or b"format ascii" in b[:i]:
        return np.array(b[j + 1:b.index(b")", j)].split(), dtype=np.float64)
    return np.frombuffer(b, "<f8", n, j + 1)


def check_order(case, dims):
    """cell centres as OpenFOAM has them: x fastest, then y, then z."""
    foam(case, "postProcess", "-func", "writeCellCentres", "-time", "0")
    n = int(np.prod(dims))
    for axis, name in enumerate("xyz"):
        c = read_field(os.path.join(case, "0", "C" + name), n).reshape(dims[::-1])   # [z][y][x]
        want = (np.arange(dims[axis]) + 0.5) * H
        shape = [1, 1, 1]
        shape[2 - axis] = -1
        assert np.allclose(c, want.reshape(shape), atol=1e-6), name
    for f in os.listdir(os.path.join(case, "0")):
        if f in ("C", "Cx", "Cy", "Cz"):
            os.remove(os.path.join(case, "0", f))


def write_vdb(path, density, seconds):
    """density[z][y][x] as a VDB fog volume whose voxel (0,0,0) stands at the centre of cell 0."""
    import pyopenvdb as vdb
    grid = vdb.FloatGrid()
    grid.copyFromArray(np.ascontiguousarray(density.transpose(2, 1, 0)), ijk=(0, 0, 0), tolerance=PRUNE)
    grid.prune(PRUNE)
    grid.name, grid.gridClass = "density", vdb.GridClass.FOG_VOLUME
    grid.transform = vdb.createLinearTransform(voxelSize=H)
    grid.transform.translate((H / 2, H / 2, H / 2))
    grid["creator"] = "OpenFOAM 1912 pisoFoam, make_jets.py"
    grid["time"] = seconds
    vdb.write(path, grids=[grid])


def convert(case, out, n, steps, with_vdb):
    dims, _ = CASES[n]
    for kind in ["raw"] + ["vdb"] * with_vdb:
        os.makedirs(os.path.join(out, kind), exist_ok=True)
    lo, hi = 1e9, -1e9
    for s in range(steps):
        t = "%.9g" % ((s + 1) * EVERY * DT)
        a = read_field(os.path.join(case, t, "wasteGas"), int(np.prod(dims))).reshape(dims[::-1])
        lo, hi = min(lo, a.min()), max(hi, a.max())
        a = np.clip(a, 0, 1).astype(np.float32)
        np.rint(a * 255).astype(np.uint8).tofile(os.path.join(out, "raw", f"jet{n}_{s:04d}.raw"))
        if with_vdb:
            write_vdb(os.path.join(out, "vdb", f"jet{n}_{s:04d}.vdb"), a, float(t))
    meta = dict(name=f"jet{n}", dims=list(dims), steps=steps, type="u8", order="x fastest, then y, then z",
                scale="round(255 * density)", solver_range=[float(lo), float(hi)], voxel_size=H,
                time_step=EVERY * DT, axes="x crossflow, y across, z up")
    with open(os.path.join(out, f"jet{n}.json"), "w") as f:
        json.dump(meta, f, indent=1)
    print(meta, flush=True)


def main():
    ap = argparse.ArgumentParser(description="Computes the jet sequences with OpenFOAM.")
    ap.add_argument("out", help="folder for the results")
    ap.add_argument("which", nargs="*", type=int, choices=[1, 2, 3], default=[1, 2, 3], help="number of jets")
    ap.add_argument("--steps", type=int, default=100)
    ap.add_argument("--vdb", action="store_true", help="write OpenVDB files as well")
    ap.add_argument("--keep", action="store_true", help="keep OpenFOAM's own files")
    a = ap.parse_args()
    for n in a.which:
        out = os.path.join(os.path.abspath(a.out), f"jet{n}")
        case = os.path.join(out, "case")
        shutil.rmtree(case, ignore_errors=True)
        t0 = time.time()
        write_case(case, n, a.steps)
        foam(case, "blockMesh")
        foam(case, "topoSet")
        foam(case, "createPatch", "-overwrite")
        check_order(case, CASES[n][0])
        print(f"jet{n}: mesh ready, solving", flush=True)
        foam(case, "pisoFoam")
        print(f"jet{n}: solved in {time.time() - t0:.0f} s", flush=True)
        convert(case, out, n, a.steps, a.vdb)
        if not a.keep:
            for f in os.listdir(case):
                p = os.path.join(case, f)
                if f[0].isdigit() and f != "0":
                    shutil.rmtree(p)
        print(f"jet{n}: done in {time.time() - t0:.0f} s", flush=True)

if __name__ == "__main__":
    main()
