"use strict";
showBodies(data.bodies, element("bodies"));
