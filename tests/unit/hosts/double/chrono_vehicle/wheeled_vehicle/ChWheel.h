#pragma once
#include "chrono_vehicle/wheeled_vehicle/tire/ChForceElementTire.h"
