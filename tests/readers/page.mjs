// The part of the check that runs in the browser: load a model with three.js
// and look at it from very near.
import {
  Box3, FloatType, LinearSRGBColorSpace, OrthographicCamera, Scene, Vector3, WebGLRenderer, WebGLRenderTarget,
} from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

// Reads MOZ_lightmap. The meaning is that of GLTFLightMapLoaderExtension in the
// development branch of three.js, which the npm package does not have yet, and
// of GLTFHubsLightMapExtension in Mozilla Hubs: the texture holds linear
// irradiance, to be multiplied by the intensity (1 if absent); the texture
// coordinates are the second set if the file does not name another.
const lightmapReader = (parser) => ({
  name: 'MOZ_lightmap',

  loadMaterial(index) {
    const lightmap = parser.json.materials[index].extensions?.MOZ_lightmap;
    return lightmap ? withLightmap(parser, index, lightmap) : null;
  },
});

async function withLightmap(parser, index, { intensity = 1, ...texture }) {
  const [material, shared] = await Promise.all([
    parser.loadMaterial(index),
    parser.assignTexture({}, 'lightMap', { texCoord: 1, ...texture }),
  ]);
  if (!shared) throw new Error(`material ${index}: the light map is missing`);
  material.lightMap = shared.clone();
  material.lightMap.colorSpace = LinearSRGBColorSpace;
  material.lightMapIntensity = intensity;
  return material;
}

// What the materials of a mode must be.
const modes = {
  unlit: (material) => material.isMeshBasicMaterial,
  vertex: (material) => material.isMeshBasicMaterial && material.vertexColors,
  lightmap: (material) => material.isMeshStandardMaterial && material.lightMap !== null,
};

// The scene of a model without its lights: they are in the baked light already.
async function load(url, mode) {
  const loader = new GLTFLoader().register(lightmapReader);
  const model = (await loader.loadAsync(url)).scene;
  const lights = [];
  const materials = [];
  model.traverse((object) => {
    if (object.isLight) lights.push(object);
    if (object.isMesh) materials.push(object.material);
  });
  lights.forEach((light) => light.removeFromParent());
  if (!materials.some(modes[mode])) throw new Error(`no material is one of mode "${mode}"`);
  const scene = new Scene().add(model);
  scene.updateMatrixWorld();
  return scene;
}

// The colour shown at each point, as linear [r, g, b, a]; a is 0 where nothing is seen.
// The camera stands `near` before the point; three pixels are 1/10000 of the model wide.
async function look(url, { mode, points, near }) {
  const scene = await load(url, mode);
  const size = new Box3().setFromObject(scene).getSize(new Vector3()).length();
  const distance = near ?? 1e-3 * size;
  const half = 0.5e-4 * size;
  const camera = new OrthographicCamera(-half, half, half, -half, 0, 2 * distance);
  const target = new WebGLRenderTarget(3, 3, { type: FloatType });
  const renderer = new WebGLRenderer();
  renderer.setClearColor(0, 0);
  renderer.setRenderTarget(target);

  return points.map(({ position, normal }) => {
    const point = new Vector3(...position);
    const outward = new Vector3(...normal).normalize();
    camera.up.set(0, ...(Math.abs(outward.y) < 0.9 ? [1, 0] : [0, 1]));
    camera.position.copy(point).addScaledVector(outward, distance);
    camera.lookAt(point);
    renderer.render(scene, camera);
    const pixel = new Float32Array(4);
    renderer.readRenderTargetPixels(target, 1, 1, 1, 1, pixel);
    return [...pixel];
  });
}

window.look = look;
