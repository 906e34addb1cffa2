export {
  AmbientLight, ArrowHelper, BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, Color, CylinderGeometry,
  DirectionalLight, DoubleSide, Fog, GridHelper, Group, HemisphereLight, LatheGeometry, Matrix4, Mesh, MeshStandardMaterial,
  MeshLambertMaterial, Object3D, PCFShadowMap, PerspectiveCamera, PlaneGeometry, Quaternion, REVISION, Scene, ShadowMaterial,
  SphereGeometry, SRGBColorSpace, TorusGeometry, Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
